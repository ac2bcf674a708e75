// SPDX-License-Identifier: Apache-2.0
// Plain text: three numbers at the start of each line, or in the columns that a header names x, y and z.
import { Content } from './content';
import { countText, FileFault } from './fault';
import type { ScanBytes } from './scan_bytes';
import { countOf, inQuotesNotANumber, realOf, withoutBlanksAtEnd } from './words';

export function readText(file: ScanBytes): Content {
  return new TextReader(file).read();
}

const kBlanks = '[ \\t\\r\\v\\f]';
/** A column and what separates it from the next: blanks, or one comma or semicolon with blanks around it. */
const kColumn = new RegExp(`${kBlanks}*([^ \\t\\r\\v\\f,;]*)${kBlanks}*[,;]?`, 'y');

function columnsOf(line: string): string[] {
  const columns = [];
  kColumn.lastIndex = 0;
  while (kColumn.lastIndex < line.length) columns.push(kColumn.exec(line)![1]!);
  return columns;
}

/**
 * Does a comma stand for the decimal point? Read as a separator, "1,5 2,5 3,5" would silently become the point (1, 5, 2).
 * So where blanks or semicolons part the columns, commas must not stand inside them.
 */
function hasDecimalCommas(line: string): boolean {
  return /[^ \t\r\v\f,;],[^ \t\r\v\f,;]/.test(line) && (line.includes(';') || /[^ \t\r\v\f,;][ \t\r\v\f]+[^ \t\r\v\f,]/.test(line));
}

/** The signs with which comments begin in one program or another. */
function isComment(line: string): boolean {
  return line === '' || /^([#;%!]|\/\/)/.test(line);
}

interface Columns {
  /** Of x, y and z, counted from 0. */
  at: number[];
  /** In the header. */
  named: number;
}

/** Tables may have quotes around names and numbers. */
function withoutQuotes(word: string): string {
  return /^".*"$/.test(word) && word.length > 1 ? word.slice(1, -1) : word;
}

/** A line that names the columns, x, y and z among them. "X [m]" and "x(mm)" are "x". */
function columnNames(line: string): Columns | undefined {
  // "X [m], Y [m]": names may have blanks if something else stands between them.
  const words = /[,;]/.test(line) ? line.replace(/[,;]$/, '').split(/[,;]/) : columnsOf(line);
  const names = words.map((word) => withoutQuotes(withoutBlanksAtEnd(word.replace(/^[ \t\r\v\f]+/, ''))).split(/[[( ]/, 1)[0]!.toLowerCase());
  const at = ['x', 'y', 'z'].map((axis) => names.indexOf(axis));
  return at.includes(-1) ? undefined : { at, named: names.length };
}

class TextReader {
  private columns = [0, 1, 2];
  private last = 2;
  private commented: Columns | undefined;  // what a comment before the first point names
  private announced: number | undefined;
  private begins = true;

  constructor(private readonly file: ScanBytes) {}

  read(): Content {
    this.file.decodeText();
    const content = new Content();
    for (let line = this.nextPointLine(0); line !== undefined; line = this.nextPointLine(content.vertexCount)) {
      this.addPoint(content, line);
    }
    if (this.announced !== undefined && this.announced !== content.vertexCount) {
      throw new FileFault(`the file announces ${countText(this.announced, 'point')}, but has ${content.vertexCount}`);
    }
    if (content.vertexCount === 0 && this.announced === undefined) {
      throw new FileFault('no point (a line of three numbers) found');
    }
    return content;
  }

  private addPoint(content: Content, line: string): void {
    if (line.includes(',') && hasDecimalCommas(line)) {
      throw this.file.atLine('commas inside numbers: write decimals with a point, or separate columns with commas only');
    }
    const words = columnsOf(line);
    const value = [0, 0, 0];
    // In the order of the line, so that the first wrong one is named.
    for (let i = 0; i <= this.last; ++i) {
      const axis = this.columns.indexOf(i);
      if (axis < 0) continue;
      const number = realOf(withoutQuotes(words[i] ?? ''));
      if (number === undefined) {
        throw this.file.atLine(`expected three numbers x y z, found ${inQuotesNotANumber(words[i] ?? '')}`);
      }
      value[axis] = number;
    }
    content.addVertex(value[0]!, value[1]!, value[2]!, () => `line ${this.file.lineNumber}`);
  }

  /** The next line that should be a point: not a comment, a header or a count. */
  private nextPointLine(points: number): string | undefined {
    for (let raw = this.file.readLine(); raw !== undefined; raw = this.file.readLine()) {
      const line = raw.replace(/^[ \t\r\v\f]+/, '');
      if (isComment(line)) {
        if (this.begins && line !== '') this.commented = columnNames(line.replace(/^[#;%!/ \t]+/, ''));
        continue;
      }
      if (this.isCount(line, points)) continue;
      if (!this.begins) return line;
      this.begins = false;
      const named = columnNames(line);
      if (named !== undefined) {
        this.use(named);
        continue;
      }
      // A sentence with these words has another number of words than the lines have columns.
      if (this.commented?.named === columnsOf(line).length) this.use(this.commented);
      return line;
    }
    return undefined;
  }

  private use(columns: Columns): void {
    this.columns = columns.at;
    this.last = Math.max(...columns.at);
  }

  /**
   * The first line may be the number of points. In a file of several scans the number of the next follows the last point
   * of each.
   */
  private isCount(line: string, points: number): boolean {
    const first = this.begins && this.announced === undefined;
    if (!first && (points === 0 || this.announced !== points)) return false;
    const count = countOf(withoutBlanksAtEnd(line));
    if (count === undefined) return false;
    this.announced = points + count;
    return true;
  }
}
