// SPDX-License-Identifier: Apache-2.0

/** What is wrong with a file, for people, without the name of the file. `reason` as in docs/api.md. */
export class FileFault extends Error {
  constructor(message: string, readonly reason = 'malformed_file') {
    super(message);
  }
}

/** "1 point", "3 points"; "1 vertex", "3 vertices". */
export function countText(count: number, singular: string, plural = `${singular}s`): string {
  return `${count} ${count === 1 ? singular : plural}`;
}
