// SPDX-License-Identifier: Apache-2.0
// What a file is by how it begins, as client/io/kind_of_content.h has it. Asked only after a reader has refused the file:
// nothing that is read depends on it.
import { latin1 } from './scan_bytes';
import { integerOf, realOf, withoutComment } from './words';

/** For messages; of a format with several endings, the first of them. */
export const kKindNames: Record<string, string> = {
  ply: 'a PLY file', pcd: 'a PCD file', off: 'an OFF file', obj: 'an OBJ file', stl: 'an STL file', las: 'a LAS file',
  gltf: 'a glTF file', glb: 'a glTF file', '3mf': 'a 3MF file', xyz: 'text with a point on each line',
};

const kMagic: [start: string, ending: string][] = [['LASF', 'las'], ['glTF', 'glb']];
const kHeadBytes = 1 << 16;
const kOff = /^(st)?c?n?4?n?off *(binary|\d.*)?$/i;
const kObjWords = ['v', 'vn', 'vt', 'vp', 'f', 'l', 'p', 'o', 'g', 's', 'mtllib', 'usemtl'];
const kStlHeader = 84;
const kStlTriangle = 50;

/** The ending that the file should have, as in kKindNames; undefined if it begins like none of these. */
export function endingOfContent(bytes: Uint8Array): string | undefined {
  const head = latin1(bytes.subarray(0, kHeadBytes));
  const magic = kMagic.find(([start]) => head.startsWith(start));
  if (magic !== undefined) return magic[1];
  if (head.startsWith('PK\x03\x04')) return head.includes('3D/3dmodel.model') ? '3mf' : undefined;
  return endingOfText(textOf(head)) ?? (hasSizeOfStl(bytes) ? 'stl' : undefined);
}

/** The header of a PLY or PCD file announces binary data, and text follows. */
export function hasTextForBinary(bytes: Uint8Array): boolean {
  const head = latin1(bytes.subarray(0, kHeadBytes)).toLowerCase();
  const header = /^(.*?format binary.*?end_header|.*?[\r\n]data binary\w*)[ \t]*\r?\n?/s.exec(head);
  const body = header === null ? '' : head.slice(header[0].length, header[0].length + 1024);
  return /^[\t-\r -~]{12,}$/.test(body) && /\d/.test(body);
}

/** Without what marks UTF-8 and UTF-16. */
function textOf(head: string): string {
  const text = head.replace(/^(\xef\xbb\xbf|\xff\xfe|\xfe\xff)/, '');
  return text.slice(0, 2).includes('\0') ? text.replaceAll('\0', '') : text;
}

function wordsOf(line: string): string[] {
  return line.split(/[ \t\v\f]+/).filter((word) => word !== '');
}

function endingOfText(text: string): string | undefined {
  const raw = text.split(/[\r\n]+/);
  const lines = raw.map((line) => wordsOf(withoutComment(line))).filter((words) => words.length > 0);
  if (lines.length === 0) return undefined;
  const first = lines[0]![0]!.toLowerCase();
  if (lines[0]!.length === 1 && first === 'ply') return 'ply';
  const fields = (word: string) => ['fields', 'columns'].includes(word.toLowerCase());
  if ((first === 'version' || fields(first)) && lines.some((words) => fields(words[0]!))) return 'pcd';
  if (kOff.test(lines[0]!.join(' '))) return 'off';
  if (first.startsWith('solid') && /facet|endsolid/i.test(text)) return 'stl';
  if (first.startsWith('{') && text.includes('"asset"')) return 'gltf';
  if (kObjWords.includes(first) && lines.some(([word, ...rest]) => word === 'v' && beginsWithAPoint(rest))) return 'obj';
  return isTextOfPoints(raw) ? 'xyz' : undefined;
}

/**
 * Three numbers on the first line that is no comment, after a count and the names of columns. Whole numbers may also be
 * what OFF without its first word begins with.
 */
function isTextOfPoints(raw: string[]): boolean {
  const lines = raw.map((line) => wordsOf(line.replace(/[,;"]/g, ' ')))
    .filter((words) => words.length > 0 && !/^([#%!]|\/\/)/.test(words[0]!));
  if (lines[0]?.length === 1 && integerOf(lines[0][0]!) !== undefined) lines.shift();
  const names = (lines[0] ?? []).map((word) => word.split(/[[(]/, 1)[0]!.toLowerCase());
  if (['x', 'y', 'z'].every((axis) => names.includes(axis))) lines.shift();
  const point = lines[0] ?? [];
  return beginsWithAPoint(point) && point.slice(0, 3).some((word) => integerOf(word) === undefined);
}

function beginsWithAPoint(words: string[]): boolean {
  return words.length >= 3 && words.slice(0, 3).every((word) => realOf(word) !== undefined);
}

/** Binary STL has no other mark. */
function hasSizeOfStl(bytes: Uint8Array): boolean {
  if (bytes.length < kStlHeader) return false;
  const count = new DataView(bytes.buffer, bytes.byteOffset).getUint32(kStlHeader - 4, true);
  return count > 0 && bytes.length === kStlHeader + kStlTriangle * count;
}
