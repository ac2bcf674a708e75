// SPDX-License-Identifier: Apache-2.0
// Words and numbers of lines of text, as client/io/text.h has them.

/** Between words; what ends lines is not among them, but for a CR within one. */
export function isBlank(code: number): boolean {
  return code === 32 || (code >= 9 && code <= 13 && code !== 10);
}

/** A line, taken word by word. */
export class Words {
  private at = 0;

  constructor(private readonly line = '') {}

  /** The next word; empty if there is none. */
  next(): string {
    const { line } = this;
    this.skipBlanks();
    const begin = this.at;
    while (this.at < line.length && !isBlank(line.charCodeAt(this.at))) ++this.at;
    return line.slice(begin, this.at);
  }

  atEnd(): boolean {
    this.skipBlanks();
    return this.at === this.line.length;
  }

  rest(): string {
    return this.line.slice(this.at);
  }

  private skipBlanks(): void {
    while (this.at < this.line.length && isBlank(this.line.charCodeAt(this.at))) ++this.at;
  }
}

/** The line up to a '#', but for one within a number: "1.#QNAN" is what Windows writes for NaN. */
export function withoutComment(line: string): string {
  let sign = line.indexOf('#');
  while (sign > 0 && line[sign - 1] === '.') sign = line.indexOf('#', sign + 1);
  return sign < 0 ? line : line.slice(0, sign);
}

export function withoutBlanksAtEnd(line: string): string {
  let end = line.length;
  while (end > 0 && isBlank(line.charCodeAt(end - 1))) --end;
  return line.slice(0, end);
}

const kReal = /^(?:\+(?!-))?(-?(?:\d+\.?\d*|\.\d+)(?:[eEdD][+-]?\d+)?)$/;
const kNoNumber = /^(?:\+(?!-))?-?(?:inf|infinity|nan(?:\(\w*\))?|(?:\d+\.?\d*|\.\d+)#(?:inf|ind|.*nan).*)$/i;

/**
 * The whole word as a decimal number; the exponent may be a Fortran one ("1D0"). NaN for "nan" and "inf" of all kinds,
 * undefined for anything else.
 */
export function realOf(word: string): number | undefined {
  const match = kReal.exec(word);
  if (match !== null) return Number(/d/i.test(word) ? match[1]!.replace(/d/i, 'e') : match[1]);
  return kNoNumber.test(word) ? NaN : undefined;
}

/** undefined for what is no integer or does not fit into 64 bits. */
export function integerOf(word: string): number | undefined {
  if (!/^(?:\+(?!-))?-?\d+$/.test(word)) return undefined;
  const value = Number(word);
  return value >= -(2 ** 63) && value < 2 ** 63 ? value : undefined;
}

export function countOf(word: string): number | undefined {
  if (!/^\+?\d+$/.test(word)) return undefined;
  const value = Number(word);
  return value < 2 ** 64 ? value : undefined;
}

/** For messages: the printable word in quotes; "nothing" if empty. */
export function inQuotes(word: string): string {
  return word === '' ? 'nothing' : `'${printable(word)}'`;
}

/** The word, shortened, without control characters. */
export function printable(word: string): string {
  const kLongest = 40;
  return word.slice(0, kLongest).replace(/[^ -~]/g, '?') + (word.length > kLongest ? '...' : '');
}

/** inQuotes of what stands where a number should, and advice if it is one with a decimal comma. */
export function inQuotesNotANumber(word: string): string {
  const comma = word.indexOf(',');
  const decimal = comma > 0 && /\d,\d/.test(word.slice(comma - 1, comma + 2));
  return inQuotes(word) + (decimal ? ': decimals are written with a point, not with a comma' : '');
}
