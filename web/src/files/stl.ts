// SPDX-License-Identifier: Apache-2.0
// STL, binary and ASCII; corners at the same position become one vertex. three's STLLoader takes what is cut short for the
// whole.
import { Content, Corners } from './content';
import { countText, FileFault } from './fault';
import type { ScanBytes } from './scan_bytes';
import { VertexTable } from './vertex_table';
import { WordReader } from './word_reader';
import { inQuotes, inQuotesNotANumber, realOf, withoutComment, Words } from './words';

const kHeaderBytes = 80;
const kTriangleBytes = 50;  // normal, three corners, two attribute bytes
const kNormalBytes = 12;
const kSniffedBytes = 1024;  // a text file this long without a zero byte is text

export function readStl(file: ScanBytes): Content {
  return new StlReader(file).read();
}

class StlReader {
  private readonly content = new Content();
  private readonly fan = new Corners(this.content);
  private readonly vertexAt = new VertexTable();
  private readonly words: WordReader;

  constructor(private readonly file: ScanBytes) {
    this.words = new WordReader(file);
  }

  read(): Content {
    if (this.looksAscii()) this.readAscii();
    else this.readBinary();
    return this.content;
  }

  /** Binary files may start with "solid" too, so the exact size of a binary file, or a zero byte, decides. */
  private looksAscii(): boolean {
    const { file } = this;
    const room = file.remaining - kHeaderBytes - 4;
    if (room >= 0 && room === kTriangleBytes * this.announced()) return false;
    file.decodeText();
    // Zero bytes may fill up the end of a text file.
    const head = file.peek(kSniffedBytes).replace(/\0+$/, '');
    return firstWord(head).slice(0, 5).toLowerCase() === 'solid' && !head.includes('\0');
  }

  private announced(): number {
    return this.file.data.getUint32(this.file.offset + kHeaderBytes, true);
  }

  private readBinary(): void {
    const { file } = this;
    if (file.remaining < kHeaderBytes + 4) {
      throw new FileFault(
        `expected 'solid' (ASCII STL) or the 84 bytes a binary STL starts with, found ${file.remaining} bytes`);
    }
    const head = file.peek(kSniffedBytes);
    if (!/[\0-\x08\x0e-\x1f\x7f]/.test(head)) {
      throw new FileFault(`expected 'solid', found ${inQuotes(firstWord(head))}; this is not an ASCII STL file, and its size is ` +
        'not that of a binary one');
    }
    const count = this.announced();
    file.offset += kHeaderBytes + 4;
    const room = Math.floor(file.remaining / kTriangleBytes);
    if (count > room) {
      // Four letters where the number of triangles stands are no number.
      if (/^[\t-~]{4}$/.test(head.slice(kHeaderBytes, kHeaderBytes + 4))) {
        throw new FileFault("this is not an STL file: it does not begin with 'solid' and does not have the size of a binary one");
      }
      throw file.atByte(kHeaderBytes, `the header announces ${countText(count, 'triangle')}, but the file has room for ${room}`);
    }
    const data = file.data;
    for (let i = 0; i < count; ++i, file.offset += kTriangleBytes) {
      this.fan.begin();
      for (let corner = 0; corner < 3; ++corner) {
        const at = file.offset + kNormalBytes + 12 * corner;
        this.addCorner(data.getFloat32(at, true), data.getFloat32(at + 4, true), data.getFloat32(at + 8, true),
          () => `byte ${file.offset}, triangle ${i}`);
      }
    }
    if (!file.onlyPaddingLeft()) {
      throw file.atByte(file.offset, `data after the last of the announced ${countText(count, 'triangle')}`);
    }
  }

  /** solid (facet, outer loop, vertex x 3, endloop, endfacet)* endsolid, one or more times. */
  private readAscii(): void {
    for (let word = this.nextKeyword(); word !== ''; word = this.nextKeyword()) {
      if (word.toLowerCase() !== 'solid') throw this.unexpected('solid', word);
      this.skipName();
      // Some programs write the name after "endsolid" without a blank.
      for (word = this.nextKeyword(); !word.toLowerCase().startsWith('endsolid'); word = this.nextKeyword()) {
        if (this.words.ended) throw this.unexpected('endsolid', word);
        if (word.toLowerCase() !== 'facet') throw this.unexpected('facet', word);
        this.readFacet();
      }
      this.words.endLine();
    }
  }

  /** Some programs write "end loop", "end facet" and "end solid". */
  private nextKeyword(): string {
    const word = this.words.next();
    return word.toLowerCase() === 'end' ? `end${this.words.nextOnLine()}` : word;
  }

  /** A solid may also stand on one line with its facets; its name may have several words. */
  private skipName(): void {
    const words = this.words.wordsOnLine().map((word) => word.toLowerCase());
    const facet = words.findIndex((word, i) => word === 'facet' && words[i + 1] === 'normal');
    for (let i = facet < 0 ? words.length : facet; i > 0; --i) this.words.nextOnLine();
  }

  private readFacet(): void {
    let word = this.words.next();
    if (word.toLowerCase() === 'normal') {
      word = this.words.next();
      for (let i = 0; i < 3 && word.toLowerCase() !== 'outer'; ++i) word = this.words.next();
    }
    if (word.toLowerCase() !== 'outer') throw this.unexpected('outer', word);
    this.expect('loop');
    this.fan.begin();
    for (let corner = 0; corner < 3; ++corner) {
      this.expect('vertex');
      this.readCorner();
    }
    this.expect('endloop');
    this.expect('endfacet');
  }

  private expect(keyword: string): void {
    const word = this.nextKeyword();
    if (word.toLowerCase() !== keyword) throw this.unexpected(keyword, word);
  }

  private unexpected(keyword: string, word: string): FileFault {
    if (this.words.ended) return this.file.afterLastLine(`expected '${keyword}'`);
    return this.file.atLine(`expected '${keyword}', found ${inQuotes(word)}`);
  }

  private readCorner(): void {
    const { file } = this;
    const begun = file.lineNumber;
    const number = () => {
      const word = this.words.next();
      const value = realOf(word);
      if (value !== undefined) return value;
      const sameLine = begun === file.lineNumber && !this.words.ended;
      throw file.atLine(`expected three numbers after 'vertex', found ${sameLine ? inQuotesNotANumber(word) : 'nothing'}`, begun);
    };
    this.addCorner(number(), number(), number(), () => `line ${file.lineNumber}`);
  }

  private addCorner(x: number, y: number, z: number, where: () => string): void {
    const known = this.vertexAt.place(x, y, z, this.content.vertices, this.content.vertexCount);
    if (known === undefined) this.content.addVertex(x, y, z, where);
    this.fan.add(known ?? this.content.vertexCount - 1);
  }
}

/** Of text, after blank lines and comments. */
function firstWord(text: string): string {
  for (const line of text.split(/[\r\n]/)) {
    const word = new Words(withoutComment(line)).next();
    if (word !== '') return word;
  }
  return '';
}
