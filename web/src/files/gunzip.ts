// SPDX-License-Identifier: Apache-2.0
// Files packed by gzip (RFC 1952), as client/io/byte_source.cpp unpacks them.
import { FileFault } from './fault';
import { inflate, InflateFault, Unpacked } from './inflate';

/** Scans as text shrink to a third, those of few different numbers to a twentieth. */
const kGreatestPackingRatio = 200;
const kAlwaysUnpackedBytes = 64 << 20;

const kHasChecksum = 2;
const kHasExtra = 4;
const kHasName = 8;
const kHasComment = 16;

export function isPacked(bytes: Uint8Array): boolean {
  return bytes[0] === 0x1f && bytes[1] === 0x8b && bytes[2] === 8;
}

/** Several members are one file. Throws a FileFault. */
export function gunzip(packed: Uint8Array): Uint8Array {
  const to = new Unpacked();
  const check = () => {
    if (to.length > kAlwaysUnpackedBytes && to.length / kGreatestPackingRatio > packed.length) {
      throw new FileFault(`more than ${kGreatestPackingRatio} times as large when unpacked, which is not read from packed ` +
        'files; if it is meant to be, unpack it first, e.g. with gunzip');
    }
  };
  try {
    for (let at = 0; at < packed.length;) {
      at = member(packed, at, to, check);
      // After a member comes the next one, the end, or zero bytes up to it.
      const next = packed.subarray(at).findIndex((byte) => byte !== 0);
      if (next < 0) return to.bytes;
      if (next > 0 || packed[at] !== 0x1f) throw new FileFault('data after the gzip data');
    }
  } catch (error) {
    if (!(error instanceof InflateFault)) throw error;
    throw new FileFault(error.cutShort ? 'the gzip data is cut short' : 'the gzip data is damaged');
  }
  return to.bytes;
}

/** Returns where it ends. */
function member(packed: Uint8Array, begin: number, to: Unpacked, check: () => void): number {
  const start = to.length;
  const end = inflate(packed, endOfHeader(packed, begin), to, check);
  if (end + 8 > packed.length) throw new InflateFault(true);
  const trailer = new DataView(packed.buffer, packed.byteOffset + end, 8);
  const bytes = to.bytes.subarray(start);
  if (trailer.getUint32(0, true) !== crc32(bytes) || trailer.getUint32(4, true) !== bytes.length % 2 ** 32) {
    throw new InflateFault(false);
  }
  return end + 8;
}

function endOfHeader(packed: Uint8Array, begin: number): number {
  const flags = packed[begin + 3] ?? 0;
  if (begin + 10 > packed.length) throw new InflateFault(true);
  if (!isPacked(packed.subarray(begin)) || flags >= 32) throw new InflateFault(false);
  let at = begin + 10;
  if (flags & kHasExtra) at += 2 + (packed[at] ?? 0) + 256 * (packed[at + 1] ?? 0);
  for (const text of [kHasName, kHasComment]) {
    if (!(flags & text)) continue;
    const zero = packed.indexOf(0, at);
    if (zero < 0) throw new InflateFault(true);
    at = zero + 1;
  }
  return flags & kHasChecksum ? at + 2 : at;
}

let table: Uint32Array | undefined;

export function crc32(bytes: Uint8Array): number {
  table ??= Uint32Array.from({ length: 256 }, (_, n) => {
    for (let bit = 0; bit < 8; ++bit) n = n & 1 ? 0xedb88320 ^ (n >>> 1) : n >>> 1;
    return n;
  });
  let crc = 0xffffffff;
  for (let i = 0; i < bytes.length; ++i) crc = table[(crc ^ bytes[i]!) & 255]! ^ (crc >>> 8);
  return ~crc >>> 0;
}
