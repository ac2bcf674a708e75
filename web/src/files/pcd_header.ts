// SPDX-License-Identifier: Apache-2.0
import type { ScalarType } from './scalar';
import type { ScanBytes } from './scan_bytes';
import { countText } from './fault';
import { countOf, inQuotes, withoutComment, Words } from './words';

export interface PcdField {
  name: string;
  size: number;
  type: 'F' | 'I' | 'U';
  count: number;
}

export interface PcdHeader {
  fields: PcdField[];
  points: number;
  encoding: 'ascii' | 'binary' | 'binary_compressed';
  /** The fields x, y and z, and their types. */
  coordinates: number[];
  types: ScalarType[];
}

/** Padding before the next field. */
export function isPadding(field: PcdField): boolean {
  return field.name === '_';
}

/** Of the fields before the one at `end`. */
export function bytesBefore(fields: PcdField[], end: number, withPadding: boolean): number {
  return fields.slice(0, end).reduce((sum, one) => sum + (withPadding || !isPadding(one) ? one.size * one.count : 0), 0);
}

/** Reads up to and including the line DATA. Throws a FileFault with the line. */
export function readPcdHeader(file: ScanBytes): PcdHeader {
  return new HeaderParser(file).parse();
}

class HeaderParser {
  private fields: PcdField[] = [];
  private coordinates: number[] = [];
  private readonly numbers: { WIDTH?: number; HEIGHT?: number; POINTS?: number } = {};
  private encoding: PcdHeader['encoding'] = 'ascii';

  constructor(private readonly file: ScanBytes) {}

  parse(): PcdHeader {
    const { file } = this;
    for (let line = file.readLine(); line !== undefined; line = file.readLine()) {
      const words = new Words(withoutComment(line));
      const word = words.next();
      if (word === '') continue;
      this.parseLine(word, words);
      if (word.toLowerCase() === 'data') return this.checked();
    }
    throw file.atLine('the file ends before the DATA line of the PCD header');
  }

  private parseLine(word: string, words: Words): void {
    const keyword = word.toUpperCase();
    switch (keyword) {
      case 'VERSION': case 'VIEWPOINT': return;
      case 'FIELDS': case 'COLUMNS': this.parseFields(words); return;
      // COUNT 0 is what PCL writes of padding that is not needed.
      case 'SIZE': this.parseEach(keyword, words, (field, number) => { field.size = number; }, 1, 8); return;
      case 'COUNT': this.parseEach(keyword, words, (field, number) => { field.count = number; }, 0, 2 ** 32 - 1); return;
      case 'TYPE': this.parseTypes(words); return;
      case 'WIDTH': case 'HEIGHT': case 'POINTS': this.parseNumber(keyword, words.next()); return;
      case 'DATA': this.parseEncoding(words.next()); return;
    }
    throw this.file.atLine('expected a PCD keyword (VERSION FIELDS SIZE TYPE COUNT WIDTH HEIGHT VIEWPOINT POINTS DATA), ' +
      `found ${inQuotes(word)}`);
  }

  private parseFields(words: Words): void {
    if (this.fields.length > 0) throw this.file.atLine('a second FIELDS line');
    for (let name = words.next(); name !== ''; name = words.next()) this.fields.push({ name, size: 4, type: 'F', count: 1 });
    this.coordinates = ['x', 'y', 'z'].map((axis) => this.coordinate(axis));
  }

  /** A name in capitals counts if there is none in lower case. */
  private coordinate(axis: string): number {
    for (const name of [axis, axis.toUpperCase()]) {
      const at = this.fields.flatMap((one, i) => (one.name === name ? [i] : []));
      if (at.length > 1) throw this.file.atLine(`field '${name}' appears twice`);
      if (at.length === 1) return at[0]!;
    }
    throw this.file.atLine(`FIELDS has no field '${axis}'`);
  }

  private parseEach(keyword: string, words: Words, set: (field: PcdField, number: number) => void, least: number, most: number): void {
    for (const field of this.fields) {
      const word = words.next();
      const number = countOf(word);
      if (number === undefined || number < least || number > most) {
        throw this.file.atLine(`expected ${keyword} ${least} to ${most} for field ${inQuotes(field.name)}, found ${inQuotes(word)}`);
      }
      set(field, number);
    }
    this.endOfEach(keyword, words);
  }

  private parseTypes(words: Words): void {
    for (const field of this.fields) {
      const word = words.next();
      const type = word.toUpperCase();
      if (type !== 'F' && type !== 'I' && type !== 'U') {
        throw this.file.atLine(`expected TYPE F, I or U for field ${inQuotes(field.name)}, found ${inQuotes(word)}`);
      }
      field.type = type;
    }
    this.endOfEach('TYPE', words);
  }

  private endOfEach(keyword: string, words: Words): void {
    if (words.next() === '' && this.fields.length > 0) return;
    throw this.file.atLine(
      `${keyword} must follow FIELDS and have one entry for each of its ${countText(this.fields.length, 'field')}`);
  }

  private parseNumber(keyword: 'WIDTH' | 'HEIGHT' | 'POINTS', word: string): void {
    const number = countOf(word);
    if (number === undefined) throw this.file.atLine(`expected a number after ${keyword}, found ${inQuotes(word)}`);
    this.numbers[keyword] = number;
  }

  private parseEncoding(word: string): void {
    const encoding = word.toLowerCase();
    if (encoding !== 'ascii' && encoding !== 'binary' && encoding !== 'binary_compressed') {
      throw this.file.atLine(`expected DATA ascii, binary or binary_compressed, found ${inQuotes(word)}`);
    }
    this.encoding = encoding;
  }

  /** Checks across lines; completes the number of points. */
  private checked(): PcdHeader {
    const { file, fields } = this;
    if (fields.length === 0) throw file.atLine('the header has no FIELDS line');
    const types = this.coordinates.map((at) => {
      const field = fields[at]!;
      const sizes = field.type === 'F' ? [4, 8] : [1, 2, 4, 8];
      if (field.count === 1 && sizes.includes(field.size)) return `${field.type.toLowerCase()}${field.size}` as ScalarType;
      throw file.atLine(
        `field '${field.name}' is ${field.count} x ${field.type}${field.size}; expected one F4, F8, I or U number`);
    });
    return { fields, points: this.points(), encoding: this.encoding, coordinates: this.coordinates, types };
  }

  private points(): number {
    const { file } = this;
    let { WIDTH: width } = this.numbers;
    const { HEIGHT: height = 1, POINTS: points } = this.numbers;
    // As PCL: a cloud without rows has one, and one without columns has all points in one row.
    if (height === 0 && (width ?? 0) === 0 && points !== undefined) width = points;
    if (width !== undefined) {
      const product = width * Math.max(height, 1);
      if (product >= 2 ** 64) throw file.atLine('WIDTH times HEIGHT is absurdly large');
      if ((points ?? product) !== product) throw file.atLine(`POINTS is ${points}, but WIDTH times HEIGHT is ${product}`);
      return product;
    }
    if (points === undefined) throw file.atLine('the header has neither POINTS nor WIDTH');
    return points;
  }
}
