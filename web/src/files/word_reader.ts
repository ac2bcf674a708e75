// SPDX-License-Identifier: Apache-2.0
// The words of a text file, over the ends of lines, as client/io/word_reader.h has them.
import type { ScanBytes } from './scan_bytes';
import { Words, withoutComment } from './words';

export class WordReader {
  /** There was no line left. */
  ended = false;
  private words = new Words();

  /** Lines that begin with a word of `skipped` and a blank are skipped: "comment" in PLY. */
  constructor(private readonly file: ScanBytes, private readonly skipped: readonly string[] = []) {}

  /** Drops the rest of the line and goes to the next that has a word; false at the end of the file. */
  nextLine(): boolean {
    for (let line = this.file.readLine(); line !== undefined; line = this.file.readLine()) {
      const content = withoutComment(line);
      const first = new Words(content).next();
      if (first === '' || (this.skipped.length > 0 && this.skipped.includes(first.toLowerCase()))) continue;
      this.words = new Words(content);
      return true;
    }
    this.words = new Words();
    this.ended = true;
    return false;
  }

  endLine(): void {
    this.words = new Words();
  }

  atLineEnd(): boolean {
    return this.words.atEnd();
  }

  /** Words left on the line, which stay there. */
  wordsOnLine(): string[] {
    const rest = new Words(this.words.rest());
    const words = [];
    for (let word = rest.next(); word !== ''; word = rest.next()) words.push(word);
    return words;
  }

  /** The next word of this line or a later one; empty at the end of the file. */
  next(): string {
    for (;;) {
      const word = this.words.next();
      if (word !== '' || !this.nextLine()) return word;
    }
  }

  nextOnLine(): string {
    return this.words.next();
  }

  /**
   * One record a line is what every writer does, but line ends are no more than blanks to the formats: a file that has
   * fewer lines left than records is read word by word. Unknown in a long file: false.
   */
  hasFewerLinesThan(records: number): boolean {
    const left = this.file.contentLinesLeft();
    return left !== undefined && (this.atLineEnd() ? 0 : 1) + left < records;
  }
}
