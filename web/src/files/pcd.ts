// SPDX-License-Identifier: Apache-2.0
// PCD of the Point Cloud Library: ascii, binary and binary_compressed. three's PCDLoader misplaces fields of several
// values or none, and takes part of a file for the whole.
import { Content } from './content';
import { countText } from './fault';
import type { FileFault } from './fault';
import { unpackLzf } from './lzf';
import type { PcdHeader } from './pcd_header';
import { bytesBefore, readPcdHeader } from './pcd_header';
import { loadScalar, scalarSize } from './scalar';
import { noRoom } from './scan_bytes';
import type { ScanBytes } from './scan_bytes';
import { inQuotes, inQuotesNotANumber, realOf, withoutComment, Words } from './words';

/** LZF writes at most 264 bytes (its longest back reference) for 3 bytes read. */
const kLzfGreatestRatio = 88;

export function readPcd(file: ScanBytes): Content {
  file.decodeText();
  return new PcdBody(file, readPcdHeader(file)).read();
}

class PcdBody {
  private readonly content = new Content();

  constructor(private readonly file: ScanBytes, private readonly header: PcdHeader) {}

  read(): Content {
    const { file, header } = this;
    if (header.encoding === 'ascii') {
      this.readAscii();
      return this.content;
    }
    file.beginBinary();
    if (header.encoding === 'binary') this.readBinary();
    else this.readCompressed();
    // PCL writes zero bytes after the points.
    if (!file.onlyPaddingLeft()) throw file.atByte(file.offset, this.afterTheLast());
    return this.content;
  }

  /** A point with a coordinate that is not finite means "nothing measured here". */
  private add(x: number, y: number, z: number): void {
    if (Number.isFinite(x) && Number.isFinite(y) && Number.isFinite(z)) this.content.addVertex(x, y, z, () => '');
    else ++this.content.skipped;
  }

  private afterTheLast(): string {
    return `data after the last of the announced ${countText(this.header.points, 'point')}`;
  }

  private readAscii(): void {
    const { points } = this.header;
    for (let i = 0; i < points; ++i) {
      const line = this.nextContentLine();
      if (line === undefined) {
        throw this.file.afterLastLine(`the header announces ${countText(points, 'point')}, found ${i}`);
      }
      this.readAsciiPoint(new Words(line));
    }
    if (this.nextContentLine() !== undefined) throw this.file.atLine(this.afterTheLast());
  }

  private nextContentLine(): string | undefined {
    for (let line = this.file.readLine(); line !== undefined; line = this.file.readLine()) {
      const content = withoutComment(line);
      if (!new Words(content).atEnd()) return content;
    }
    return undefined;
  }

  private readAsciiPoint(words: Words): void {
    const { fields, coordinates } = this.header;
    const value = [0, 0, 0];
    fields.forEach((field, f) => {
      const axis = coordinates.indexOf(f);
      for (let c = 0; c < field.count; ++c) {
        const word = words.next();
        const number = axis >= 0 ? realOf(word) : word === '' ? undefined : 0;
        if (number === undefined) {
          throw this.file.atLine(`expected a number for field ${inQuotes(field.name)}, found ${inQuotesNotANumber(word)}`);
        }
        if (axis >= 0) value[axis] = number;
      }
    });
    const extra = words.next();
    if (extra !== '') throw this.file.atLine(`expected the line end after the last field, found ${inQuotes(extra)}`);
    this.add(value[0]!, value[1]!, value[2]!);
  }

  private readBinary(): void {
    const { file, header: { fields, points, coordinates } } = this;
    const size = bytesBefore(fields, fields.length, true);
    const room = Math.floor(file.remaining / size);
    if (points > room) throw this.tooShort(noRoom(points, 'point', size, room));
    const offsets = coordinates.map((at) => bytesBefore(fields, at, true));
    this.addAll(file.data, offsets.map((one) => file.offset + one), [size, size, size]);
    file.offset += points * size;
  }

  /** `begin` and `stride` of each coordinate. */
  private addAll(data: DataView, begin: number[], stride: number[]): void {
    const { points, types } = this.header;
    for (let i = 0; i < points; ++i) {
      const load = (axis: number) => loadScalar(data, begin[axis]! + i * stride[axis]!, types[axis]!, true);
      this.add(load(0), load(1), load(2));
    }
  }

  /** Two sizes, then LZF data: all values of the first field, all of the second, ... */
  private readCompressed(): void {
    const { file, header: { fields, points } } = this;
    if (file.remaining < 8) throw this.tooShort('expected the compressed and the uncompressed size');
    const packed = file.data.getUint32(file.offset, true);
    const unpacked = file.data.getUint32(file.offset + 4, true);
    file.offset += 8;
    // PCL leaves padding out of compressed data; others write it.
    const sizeOf = (withPadding: boolean) => bytesBefore(fields, fields.length, withPadding);
    const fits = (withPadding: boolean) => unpacked === points * sizeOf(withPadding);
    if (!fits(false) && !fits(true)) {
      throw this.tooShort('the compressed data does not unpack to the announced ' +
        `${countText(points, 'point')} of ${countText(sizeOf(false), 'byte')}`);
    }
    if (points === 0) return;
    if (unpacked > packed * kLzfGreatestRatio || file.remaining < packed) {
      throw this.tooShort(
        `the compressed data is cut short: announced ${packed} bytes for ${unpacked}, found ${file.remaining}`);
    }
    const source = file.take(packed);
    // Some programs write data that does not get smaller as it is.
    const bytes = unpackLzf(source, unpacked) ?? (packed === unpacked ? source : undefined);
    if (bytes === undefined) {
      file.offset -= packed;
      throw this.tooShort('the compressed data is damaged');
    }
    this.readFieldByField(new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength), !fits(false));
  }

  private readFieldByField(data: DataView, withPadding: boolean): void {
    const { fields, points, coordinates, types } = this.header;
    this.addAll(data, coordinates.map((at) => bytesBefore(fields, at, withPadding) * points), types.map(scalarSize));
  }

  private tooShort(what: string): FileFault {
    return this.file.atByte(this.file.offset, what);
  }
}
