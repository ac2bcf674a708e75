// SPDX-License-Identifier: Apache-2.0
import { FileFault } from './fault';
import type { ScalarType } from './scalar';
import { isFloating, scalarSize } from './scalar';
import type { ScanBytes } from './scan_bytes';
import { countOf, inQuotes, isBlank, printable, Words } from './words';

export interface PlyProperty {
  name: string;
  /** Of the value, or of each entry of the list. */
  type: ScalarType;
  /** Of a list: the type of its length. */
  countType?: ScalarType;
}

export interface PlyElement {
  /** In lower case, printable. */
  name: string;
  /** As announced, not yet verified. */
  count: number;
  properties: PlyProperty[];
}

export type PlyEncoding = 'ascii' | 'binary_little_endian' | 'binary_big_endian';

export interface PlyHeader {
  encoding: PlyEncoding;
  elements: PlyElement[];
}

const kTypes: Record<string, ScalarType> = {
  char: 'i1', int8: 'i1', uchar: 'u1', uint8: 'u1', bool: 'u1', short: 'i2', int16: 'i2', ushort: 'u2', uint16: 'u2',
  int: 'i4', int32: 'i4', uint: 'u4', uint32: 'u4', int64: 'i8', uint64: 'u8',
  float: 'f4', float32: 'f4', double: 'f8', float64: 'f8',
};

/** Bytes of one binary record; undefined if it has a list. */
export function fixedSize(element: PlyElement): number | undefined {
  if (element.properties.some((one) => one.countType !== undefined)) return undefined;
  return element.properties.reduce((sum, one) => sum + scalarSize(one.type), 0);
}

/** Stops at the first byte after the header. Throws a FileFault with the line. */
export function readPlyHeader(file: ScanBytes): PlyHeader {
  file.decodeText();
  const start = file.peek(4);
  if (start.length < 4 || start.slice(0, 3).toLowerCase() !== 'ply' || (start[3] !== '\n' && !isBlank(start.charCodeAt(3)))) {
    throw new FileFault("line 1: expected 'ply'; this is not a PLY file");
  }
  file.readLine();
  let encoding: PlyEncoding | undefined;
  const elements: PlyElement[] = [];
  for (let line = file.readLine(); line !== undefined; line = file.readLine()) {
    const words = new Words(line);
    const keyword = words.next().toLowerCase();
    switch (keyword) {
      case 'end_header':
        if (encoding === undefined) throw file.atLine("the header has no 'format' line");
        return { encoding, elements };
      case 'format': encoding = formatIn(file, words); break;
      case 'element': elements.push(elementIn(file, words)); break;
      case 'property':
        if (elements.length === 0) throw file.atLine("'property' before any 'element'");
        elements.at(-1)!.properties.push(propertyIn(file, words));
        break;
      // Blender 2.4 left out "comment" before "Created by".
      case '': case 'comment': case 'obj_info': case 'created': break;
      default:
        throw file.atLine(`expected format, element, property, comment, obj_info or end_header, found ${inQuotes(keyword)}`);
    }
  }
  throw file.atLine("the file ends before 'end_header'");
}

function formatIn(file: ScanBytes, words: Words): PlyEncoding {
  const word = words.next();
  const encoding = word.toLowerCase();
  if (encoding === 'ascii' || encoding === 'binary_little_endian' || encoding === 'binary_big_endian') return encoding;
  throw file.atLine(`expected format ascii, binary_little_endian or binary_big_endian, found ${inQuotes(word)}`);
}

function elementIn(file: ScanBytes, words: Words): PlyElement {
  const name = printable(words.next()).toLowerCase();
  const word = words.next();
  const count = countOf(word);
  if (name === '' || count === undefined) throw file.atLine(`expected 'element NAME COUNT', found count ${inQuotes(word)}`);
  return { name, count, properties: [] };
}

function propertyIn(file: ScanBytes, words: Words): PlyProperty {
  const typeOf = (word: string) => {
    const lower = word.toLowerCase();
    if (Object.hasOwn(kTypes, lower)) return kTypes[lower]!;
    throw file.atLine(
      `expected a type (char uchar short ushort int uint float double, or int8 to float64), found ${inQuotes(word)}`);
  };
  let word = words.next();
  let countType: ScalarType | undefined;
  if (word.toLowerCase() === 'list') {
    word = words.next();
    countType = typeOf(word);
    if (isFloating(countType)) {
      throw file.atLine(`expected an integer type for the length of a list, found ${inQuotes(word)}`);
    }
    word = words.next();
  }
  const type = typeOf(word);
  const name = printable(words.next());
  if (name === '') throw file.atLine('expected a property name, found nothing');
  return countType === undefined ? { name, type } : { name, type, countType };
}
