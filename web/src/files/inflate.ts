// SPDX-License-Identifier: Apache-2.0
// What DEFLATE has packed (RFC 1951). The browser's DecompressionStream refuses gzip files of several members, and tells
// nothing of where one ends.

/** Thrown for data that is damaged or cut short. */
export class InflateFault extends Error {
  constructor(readonly cutShort: boolean) {
    super(cutShort ? 'cut short' : 'damaged');
  }
}

const kLengthBase = [3, 4, 5, 6, 7, 8, 9, 10, 11, 13, 15, 17, 19, 23, 27, 31, 35, 43, 51, 59, 67, 83, 99, 115, 131, 163, 195, 227, 258];
const kLengthBits = [0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3, 4, 4, 4, 4, 5, 5, 5, 5, 0];
const kDistanceBase = [
  1, 2, 3, 4, 5, 7, 9, 13, 17, 25, 33, 49, 65, 97, 129, 193, 257, 385, 513, 769, 1025, 1537, 2049, 3073, 4097, 6145, 8193,
  12289, 16385, 24577,
];
const kDistanceBits = [0, 0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5, 6, 6, 7, 7, 8, 8, 9, 9, 10, 10, 11, 11, 12, 12, 13, 13];
const kOrder = [16, 17, 18, 0, 8, 7, 9, 6, 10, 5, 11, 4, 12, 3, 13, 2, 14, 1, 15];
const kMostBits = 15;

/** Unpacked bytes, in an array that grows. */
export class Unpacked {
  length = 0;
  private array = new Uint8Array(1 << 16);

  get bytes(): Uint8Array { return this.array.subarray(0, this.length); }

  /** Room for `count` more. */
  private reserve(count: number): void {
    if (this.length + count <= this.array.length) return;
    const larger = new Uint8Array(Math.max(2 * this.array.length, this.length + count));
    larger.set(this.bytes);
    this.array = larger;
  }

  push(byte: number): void {
    this.reserve(1);
    this.array[this.length++] = byte;
  }

  append(bytes: Uint8Array): void {
    this.reserve(bytes.length);
    this.array.set(bytes, this.length);
    this.length += bytes.length;
  }

  /** Bytes that may be among those they make. */
  repeat(distance: number, count: number): void {
    this.reserve(count);
    for (let i = 0; i < count; ++i, ++this.length) this.array[this.length] = this.array[this.length - distance]!;
  }
}

/** Codes by their lengths (Deutsch, RFC 1951, 3.2.2): symbols in the order of their codes, and how many have each length. */
interface Huffman {
  counts: Uint16Array;
  symbols: Uint16Array;
}

function huffman(lengths: ArrayLike<number>): Huffman {
  const counts = new Uint16Array(kMostBits + 1);
  for (let i = 0; i < lengths.length; ++i) ++counts[lengths[i]!]!;
  counts[0] = 0;
  let left = 1;
  const offsets = new Uint16Array(kMostBits + 2);
  for (let bits = 1; bits <= kMostBits; ++bits) {
    left = 2 * left - counts[bits]!;
    if (left < 0) throw new InflateFault(false);
    offsets[bits + 1] = offsets[bits]! + counts[bits]!;
  }
  const symbols = new Uint16Array(lengths.length);
  for (let i = 0; i < lengths.length; ++i) if (lengths[i] !== 0) symbols[offsets[lengths[i]!]!++] = i;
  return { counts, symbols };
}

const kFixedLengths = huffman(Uint8Array.from({ length: 288 }, (_, i) => (i < 144 ? 8 : i < 256 ? 9 : i < 280 ? 7 : 8)));
const kFixedDistances = huffman(new Uint8Array(30).fill(5));

/** Appends what the data at `at` unpacks to, and returns where it ends. `check` is called now and then, and may throw. */
export function inflate(packed: Uint8Array, at: number, to: Unpacked, check: () => void): number {
  const bits = new Bits(packed, at);
  for (let last = false; !last; check()) {
    last = bits.take(1) === 1;
    const kind = bits.take(2);
    if (kind === 0) bits.storedBlock(to);
    else if (kind === 1) codedBlock(bits, to, kFixedLengths, kFixedDistances, check);
    else if (kind === 2) dynamicBlock(bits, to, check);
    else throw new InflateFault(false);
  }
  return bits.end();
}

class Bits {
  private buffer = 0;
  private count = 0;

  constructor(private readonly packed: Uint8Array, private at: number) {}

  take(count: number): number {
    while (this.count < count) {
      if (this.at >= this.packed.length) throw new InflateFault(true);
      this.buffer |= this.packed[this.at++]! << this.count;
      this.count += 8;
    }
    const value = this.buffer & ((1 << count) - 1);
    this.buffer >>>= count;
    this.count -= count;
    return value;
  }

  symbol({ counts, symbols }: Huffman): number {
    let code = 0;
    let first = 0;
    let index = 0;
    for (let bits = 1; bits <= kMostBits; ++bits) {
      code |= this.take(1);
      const count = counts[bits]!;
      if (code - count < first) return symbols[index + code - first]!;
      index += count;
      first = (first + count) << 1;
      code <<= 1;
    }
    throw new InflateFault(false);
  }

  storedBlock(to: Unpacked): void {
    this.end();
    const header = this.packed.subarray(this.at, this.at + 4);
    if (header.length < 4) throw new InflateFault(true);
    const length = header[0]! | (header[1]! << 8);
    if (length !== (~(header[2]! | (header[3]! << 8)) & 0xffff)) throw new InflateFault(false);
    this.at += 4;
    if (this.at + length > this.packed.length) throw new InflateFault(true);
    to.append(this.packed.subarray(this.at, this.at + length));
    this.at += length;
  }

  /** Drops the rest of the byte. */
  end(): number {
    this.at -= this.count >> 3;
    this.buffer = 0;
    this.count = 0;
    return this.at;
  }
}

function dynamicBlock(bits: Bits, to: Unpacked, check: () => void): void {
  const lengthCount = bits.take(5) + 257;
  const distanceCount = bits.take(5) + 1;
  const orderCount = bits.take(4) + 4;
  if (lengthCount > 286 || distanceCount > 30) throw new InflateFault(false);
  const order = new Uint8Array(19);
  for (let i = 0; i < orderCount; ++i) order[kOrder[i]!] = bits.take(3);
  const code = huffman(order);
  const lengths = new Uint8Array(lengthCount + distanceCount);
  for (let i = 0; i < lengths.length;) {
    const symbol = bits.symbol(code);
    if (symbol < 16) {
      lengths[i++] = symbol;
      continue;
    }
    if (symbol === 16 && i === 0) throw new InflateFault(false);
    const value = symbol === 16 ? lengths[i - 1]! : 0;
    const repeats = symbol === 16 ? 3 + bits.take(2) : symbol === 17 ? 3 + bits.take(3) : 11 + bits.take(7);
    if (i + repeats > lengths.length) throw new InflateFault(false);
    lengths.fill(value, i, i + repeats);
    i += repeats;
  }
  codedBlock(bits, to, huffman(lengths.subarray(0, lengthCount)), huffman(lengths.subarray(lengthCount)), check);
}

function codedBlock(bits: Bits, to: Unpacked, lengthCodes: Huffman, distanceCodes: Huffman, check: () => void): void {
  for (let symbols = 0; ; ++symbols) {
    if (symbols % (1 << 20) === 0) check();
    const symbol = bits.symbol(lengthCodes);
    if (symbol < 256) to.push(symbol);
    else if (symbol === 256) return;
    else copy(bits, to, symbol - 257, distanceCodes);
  }
}

function copy(bits: Bits, to: Unpacked, symbol: number, distanceCodes: Huffman): void {
  if (symbol >= kLengthBase.length) throw new InflateFault(false);
  const length = kLengthBase[symbol]! + bits.take(kLengthBits[symbol]!);
  const symbolOfDistance = bits.symbol(distanceCodes);
  if (symbolOfDistance >= kDistanceBase.length) throw new InflateFault(false);
  const distance = kDistanceBase[symbolOfDistance]! + bits.take(kDistanceBits[symbolOfDistance]!);
  if (distance > to.length) throw new InflateFault(false);
  to.repeat(distance, length);
}
