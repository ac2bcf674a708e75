// SPDX-License-Identifier: Apache-2.0

/** The ending before ".gz": "ply" of "scan.PLY" and "scan.ply.gz"; empty if there is none. */
export function endingOf(name: string): string {
  return /\.([^.]*?)(?:\.gz)?$/i.exec(name)?.[1]?.toLowerCase() ?? '';
}

/** "Hand/193.ply.gz" -> "Hand/193". */
export function withoutEnding(name: string): string {
  return name.replace(/\.gz$/i, '').replace(/\.[^.]*$/, '');
}
