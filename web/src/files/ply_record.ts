// SPDX-License-Identifier: Apache-2.0
// The two ways to read one record of a PLY element, with one interface.
import type { FileFault } from './fault';
import type { PlyElement } from './ply_header';
import type { ScalarType } from './scalar';
import { loadScalar, scalarSize } from './scalar';
import type { ScanBytes } from './scan_bytes';
import type { WordReader } from './word_reader';
import { inQuotesNotANumber, integerOf, realOf } from './words';

export function recordName(element: PlyElement, index: number): string {
  return `${element.name} ${index} of ${element.count}`;
}

/** What cannot be read is undefined, or false. */
export interface PlyRecord {
  begin(): boolean;
  real(type: ScalarType): number | undefined;
  integer(type: ScalarType): number | undefined;
  skip(type: ScalarType, count: number): boolean;
  end(): boolean;
  /** "line 7" or "byte 132". */
  where(): string;
  fault(element: PlyElement, index: number, property: string): FileFault;
}

/**
 * One element a line. A record may go on on the next line, but then ends with it, so that a missing number is found where
 * it is missing; only a file with fewer lines than records is read word by word.
 */
export class TextRecord implements PlyRecord {
  private line = 0;
  private word = '';

  constructor(private readonly file: ScanBytes, private readonly words: WordReader, private readonly wordByWord: boolean) {}

  begin(): boolean {
    if (this.words.atLineEnd() && !this.words.nextLine()) return false;
    this.line = this.file.lineNumber;
    return true;
  }

  real(): number | undefined {
    return realOf(this.next());
  }

  integer(): number | undefined {
    return integerOf(this.next());
  }

  skip(_type: ScalarType, count: number): boolean {
    for (let i = 0; i < count; ++i) if (this.next() === '') return false;
    return true;
  }

  end(): boolean {
    return this.wordByWord || this.words.atLineEnd() || this.next() === '';
  }

  where(): string {
    return `line ${this.file.lineNumber}`;
  }

  fault(element: PlyElement, index: number, property: string): FileFault {
    if (this.words.ended) {
      return this.file.afterLastLine(`expected ${property === '' ? '' : `${property} of `}${recordName(element, index)}`);
    }
    const begun = this.line < this.file.lineNumber ? `, which begins in line ${this.line}` : '';
    return this.file.atLine(`expected ${property} of ${recordName(element, index)}${begun}, found ${inQuotesNotANumber(this.word)}`);
  }

  private next(): string {
    return (this.word = this.words.next());
  }
}

export class BinaryRecord implements PlyRecord {
  private start = 0;

  constructor(private readonly file: ScanBytes, private readonly little: boolean) {}

  begin(): boolean {
    this.start = this.file.offset;
    return true;
  }

  real(type: ScalarType): number | undefined {
    const size = scalarSize(type);
    if (this.file.remaining < size) return undefined;
    const value = loadScalar(this.file.data, this.file.offset, type, this.little);
    this.file.offset += size;
    return value;
  }

  integer(type: ScalarType): number | undefined {
    return this.real(type);
  }

  skip(type: ScalarType, count: number): boolean {
    if (count * scalarSize(type) > this.file.remaining) return false;
    this.file.offset += count * scalarSize(type);
    return true;
  }

  end(): boolean {
    return true;
  }

  where(): string {
    return `byte ${this.start}`;
  }

  fault(element: PlyElement, index: number, property: string): FileFault {
    return this.file.atByte(this.start, `the file ends inside ${recordName(element, index)}: expected ${property}`);
  }
}
