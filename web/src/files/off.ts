// SPDX-License-Identifier: Apache-2.0
// OFF as text, with the prefixes that only add data to vertices; three.js does not read it.
import { Content, Corners } from './content';
import { countText } from './fault';
import type { FileFault } from './fault';
import type { ScanBytes } from './scan_bytes';
import { WordReader } from './word_reader';
import { countOf, inQuotes, inQuotesNotANumber, realOf } from './words';

export function readOff(file: ScanBytes): Content {
  return new OffReader(file).read();
}

class OffReader {
  private readonly content = new Content();
  private readonly words: WordReader;
  private vertices = 0;
  private faces = 0;
  /** Numbers of a vertex after its coordinates. */
  private extraNumbers = 0;
  private onCountsLine = false;
  private wordByWord = false;

  constructor(private readonly file: ScanBytes) {
    this.words = new WordReader(file);
  }

  read(): Content {
    this.file.decodeText();
    this.readHeader();
    this.wordByWord = this.words.hasFewerLinesThan(this.vertices + this.faces);
    if (this.onCountsLine) this.endRecord();
    for (let i = 0; i < this.vertices; ++i) this.readVertex(i);
    const corners = new Corners(this.content);
    for (let i = 0; i < this.faces; ++i) this.readFace(i, corners);
    if (this.words.next() !== '') {
      throw this.file.atLine(`data after the last of the announced ${countText(this.vertices, 'vertex', 'vertices')} and ` +
        countText(this.faces, 'face'));
    }
    return this.content;
  }

  /** "OFF 8 6 12", "OFF8 6 12" (in well-known collections), or without the word. */
  private readHeader(): void {
    let word = this.words.next();
    if (word === '') throw this.file.atLine('expected OFF; the file has no content');
    const name = word.toLowerCase().indexOf('off');
    if (name >= 0) {
      const prefix = /^(st)?(c)?(n)?(o)ff/i.exec(word);
      // "nOFF" has vertices of another dimension.
      if (prefix === null || (prefix[3] === 'n' && prefix[4] === 'O')) {
        throw this.file.atLine(
          `expected OFF, COFF, NOFF, STOFF or a mix of these prefixes, found ${inQuotes(word.slice(0, name + 3))}`);
      }
      this.extraNumbers = (prefix[1] ? 2 : 0) + (prefix[2] ? 4 : 0) + (prefix[3] ? 3 : 0);
      word = word.slice(prefix[0].length);
      if (word === '') word = this.words.next();
      if (word.toLowerCase() === 'binary') {
        throw this.file.atLine('binary OFF is not read; convert the file to text OFF or PLY');
      }
      if (word === '') throw this.cutShort('the numbers of vertices and faces');
    }
    this.readCounts(word);
  }

  private readCounts(vertices: string): void {
    const count = (word: string) => {
      const number = countOf(word);
      if (number !== undefined) return number;
      throw this.file.atLine(`expected the numbers of vertices and faces, found ${inQuotesNotANumber(word)}`);
    };
    this.vertices = count(vertices);
    this.faces = count(this.words.next());
    // The number of edges may be missing. It is there if it is on the line, or on one of its own.
    this.onCountsLine = !this.words.atLineEnd();
    if (this.onCountsLine || (this.words.nextLine() && this.words.wordsOnLine().length === 1)) this.words.next();
  }

  /** What follows on the line is ignored: normal, colour, texture position. */
  private endRecord(): void {
    if (!this.wordByWord) this.words.endLine();
  }

  private readVertex(index: number): void {
    const name = () => `vertex ${index} of ${this.vertices}`;
    const number = () => {
      const word = this.words.next();
      if (word === '') throw this.cutShort(name());
      const value = realOf(word);
      if (value !== undefined) return value;
      throw this.file.atLine(`expected three numbers for ${name()}, found ${inQuotesNotANumber(word)}`);
    };
    this.content.addVertex(number(), number(), number(), () => `line ${this.file.lineNumber}`);
    if (this.wordByWord) for (let i = 0; i < this.extraNumbers; ++i) this.words.next();
    this.endRecord();
  }

  private readFace(index: number, fan: Corners): void {
    const name = `face ${index} of ${this.faces}`;
    const word = this.words.next();
    if (word === '') throw this.cutShort(name);
    const corners = countOf(word);
    if (corners === undefined) {
      throw this.file.atLine(`expected the number of corners of ${name}, found ${inQuotesNotANumber(word)}`);
    }
    fan.begin();
    for (let i = 0; i < corners; ++i) fan.add(this.corner(`corner ${i} of ${name}`, name));
    this.endRecord();
  }

  private corner(what: string, face: string): number {
    const word = this.words.next();
    if (word === '') throw this.cutShort(what);
    const vertex = countOf(word);
    if (vertex === undefined) throw this.file.atLine(`expected ${what}, found ${inQuotesNotANumber(word)}`);
    if (vertex < this.vertices) return vertex;
    throw this.file.atLine(
      `${face} names vertex ${vertex}, but the file has ${countText(this.vertices, 'vertex', 'vertices')}, counted from 0`);
  }

  private cutShort(expected: string): FileFault {
    return this.file.afterLastLine(`expected ${expected}`);
  }
}
