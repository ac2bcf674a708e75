// SPDX-License-Identifier: Apache-2.0
// OFF files, which three.js does not read: a count of corners and faces, the corners, and of each face how many corners
// it has and which.
import { BufferAttribute, BufferGeometry } from 'three';

/** Without faces: a geometry without index. Throws an Error. */
export function readOff(text: string): BufferGeometry {
  const lines = text.split(/\r\n|\r|\n/).map((line) => line.replace(/#.*/, '').trim()).filter((line) => line !== '');
  const head = (lines.shift() ?? '').match(/^(ST)?(C)?(N)?OFF\s*(.*)$/);
  if (head === null) throw new Error('it does not begin with OFF');
  if (/BINARY/.test(head[4]!)) throw new Error('it is binary');
  const [corners = NaN, faces = NaN] = numbersOf(head[4] === '' ? (lines.shift() ?? '') : head[4]!);
  if (!(corners >= 0 && faces >= 0)) throw new Error('it does not tell how many corners and faces it has');
  if (lines.length < corners + faces) throw new Error(`${corners} corners and ${faces} faces are announced, fewer are there`);

  const positions = new Float32Array(3 * corners);
  for (let i = 0; i < corners; ++i) positions.set(numbersOf(lines[i]!).slice(0, 3), 3 * i);
  const triangles: number[] = [];
  for (let i = 0; i < faces; ++i) {
    const [count = 0, ...face] = numbersOf(lines[corners + i]!);
    if (face.slice(0, count).some((corner) => !(corner >= 0 && corner < corners)) || face.length < count) {
      throw new Error(`face ${i + 1} names a corner that is not there`);
    }
    for (let j = 2; j < count; ++j) triangles.push(face[0]!, face[j - 1]!, face[j]!);
  }
  const geometry = new BufferGeometry();
  geometry.setAttribute('position', new BufferAttribute(positions, 3));
  if (triangles.length > 0) geometry.setIndex(triangles);
  return geometry;
}

function numbersOf(line: string): number[] {
  return line.split(/\s+/).map(Number);
}
