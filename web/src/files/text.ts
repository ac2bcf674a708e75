// SPDX-License-Identifier: Apache-2.0
// Text with a point a line: XYZ, PTS, CSV and the like. three's XYZLoader takes lines of three or six numbers only;
// scanners also write intensities, commas and headings.
import type { Positions } from '../cloud/cloud';

/** The first three numbers of each line that begins with a number. Throws an Error that names the line. */
export function readText(text: string): Positions {
  const values: number[] = [];
  let line = 0;
  for (const raw of text.split(/\r\n|\r|\n/)) {
    ++line;
    const fields = raw.replace(/(#|\/\/).*/, '').trim().split(/[\s,;]+/).filter((field) => field !== '');
    if (fields.length === 0) continue;
    const usable = fields.length >= 3 && fields.slice(0, 3).every(isNumber);
    // A heading, or a count of points on a line of its own.
    if (!usable && values.length === 0) continue;
    if (!usable) throw new Error(`line ${line} does not begin with three numbers`);
    const point = fields.slice(0, 3).map(Number);
    values.push(...point);
  }
  if (values.length === 0) throw new Error('no line begins with three numbers');
  return new Float32Array(values);
}

/** Also one that is none: scanners write nan where they saw nothing. */
function isNumber(field: string): boolean {
  return /^nan$/i.test(field) || !Number.isNaN(Number(field));
}
