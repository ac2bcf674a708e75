// SPDX-License-Identifier: Apache-2.0
// A file read front to back, as client/io/input_file.h does.
import { countText, FileFault } from './fault';
import { isBlank } from './words';

const kTextBytes = 1 << 20;  // decoded at once

/** More of them after binary data may be points: a point of three floats has twelve bytes. */
const kMostBlanksOfPadding = 4;

export class ScanBytes {
  /** Of the line last read, from 1. */
  lineNumber = 0;
  /** UTF-16 was found: nothing binary can follow. */
  recoded = false;
  offset = 0;
  private text = '';  // of the bytes from textBegin
  private textBegin = 0;
  private lineEnds: [last: string, before: string] = ['', ''];
  private view: DataView;

  constructor(private bytes: Uint8Array) {
    this.view = viewOf(bytes);
  }

  get size(): number { return this.bytes.length; }
  get remaining(): number { return this.bytes.length - this.offset; }
  get data(): DataView { return this.view; }

  /** At most so many bytes from here, a letter for each. */
  peek(count: number): string {
    return latin1(this.bytes.subarray(this.offset, this.offset + count));
  }

  take(count: number): Uint8Array {
    this.offset += count;
    return this.bytes.subarray(this.offset - count, this.offset);
  }

  /** To be called at the start of a file of text. Skips the mark of UTF-8; UTF-16 is read as UTF-8 from now on. */
  decodeText(): void {
    const start = this.peek(4);
    if (start.startsWith('\xef\xbb\xbf')) {
      this.offset += 3;
      return;
    }
    if (start === '\xff\xfe\0\0' || start === '\0\0\xfe\xff') {
      throw new FileFault('UTF-32 text is not read; save the file as UTF-8');
    }
    const marked = start.startsWith('\xff\xfe') || start.startsWith('\xfe\xff');
    // Without a mark every second byte of the first letters is zero.
    const big = start.startsWith('\xfe\xff') || (!marked && /^\0[\t-~]\0[\t-~]$/.test(start));
    if (!marked && !big && !/^[\t-~]\0[\t-~]\0$/.test(start)) return;
    const text = this.bytes.subarray(this.offset + (marked ? 2 : 0));
    if (text.length % 2 !== 0) throw new FileFault('the file ends inside a character (UTF-16 text)');
    this.bytes = new TextEncoder().encode(new TextDecoder(big ? 'utf-16be' : 'utf-16le', { ignoreBOM: true }).decode(text));
    this.view = viewOf(this.bytes);
    this.offset = 0;
    this.recoded = true;
  }

  /** The next line without its end: LF, CR LF, or CR alone. A last one of zero bytes or Ctrl-Z is none. */
  readLine(): string | undefined {
    const { bytes, offset: begin } = this;
    let end = begin;
    while (end < bytes.length && bytes[end] !== 10 && bytes[end] !== 13) ++end;
    const lineEnd = end === bytes.length ? '' : bytes[end] === 10 ? '\n' : bytes[end + 1] === 10 ? '\r\n' : '\r';
    this.offset = end + lineEnd.length;
    const line = this.textBetween(begin, end);
    if (lineEnd === '' && /^[\0\x1a \t]*$/.test(line)) return undefined;
    this.lineEnds = [lineEnd, this.lineEnds[0]];
    ++this.lineNumber;
    return line;
  }

  /** To be called before binary data. Of lines that end in CR alone, a line feed after the last is data. */
  beginBinary(): void {
    if (this.recoded) throw new FileFault('binary data cannot follow a header in UTF-16');
    if (this.lineEnds[0] === '\r\n' && this.lineEnds[1] === '\r') --this.offset;
  }

  /** True if nothing is left but zero bytes (some writers pad) and perhaps a line end or two (editors add them). */
  onlyPaddingLeft(): boolean {
    let blanks = 0;
    for (; this.offset < this.bytes.length; ++this.offset) {
      const code = this.bytes[this.offset]!;
      if (code === 0) continue;
      if ((!isBlank(code) && code !== 10) || ++blanks > kMostBlanksOfPadding) return false;
    }
    return true;
  }

  /** Lines from here on that are not blank; undefined if the file goes on beyond 1 MiB. */
  contentLinesLeft(): number | undefined {
    if (this.remaining >= kTextBytes) return undefined;
    let lines = 0;
    let blank = true;
    for (let i = this.offset; i < this.bytes.length; ++i) {
      const code = this.bytes[i]!;
      if (code === 10 || code === 13) blank = true;
      else if (blank && !isBlank(code)) {
        blank = false;
        ++lines;
      }
    }
    return lines;
  }

  atLine(what: string, line = this.lineNumber): FileFault {
    return new FileFault(line === 0 ? 'the file is empty' : `line ${line}: ${what}`);
  }

  atByte(offset: number, what: string): FileFault {
    return new FileFault(`byte ${offset}: ${what}`);
  }

  afterLastLine(what: string): FileFault {
    return new FileFault(`the file ends after line ${this.lineNumber}: ${what}`);
  }

  private textBetween(begin: number, end: number): string {
    if (begin < this.textBegin || end > this.textBegin + this.text.length) {
      this.textBegin = begin;
      this.text = latin1(this.bytes.subarray(begin, Math.max(end, begin + kTextBytes)));
    }
    return this.text.slice(begin - this.textBegin, end - this.textBegin);
  }
}

function viewOf(bytes: Uint8Array): DataView {
  return new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
}

/** A letter for each byte. */
export function latin1(bytes: Uint8Array): string {
  return new TextDecoder('latin1').decode(bytes);
}

/** "the header announces 9 points of 12 bytes, but the file has room for 8". */
export function noRoom(count: number, what: string, size: number, room: number): string {
  return `the header announces ${countText(count, what)} of ${countText(size, 'byte')}, but the file has room for ${room}`;
}
