// SPDX-License-Identifier: Apache-2.0
// LZF, the packing of compressed PCD files: literals and references to what came before.

/** undefined if the data is damaged or does not unpack to `size` bytes. */
export function unpackLzf(packed: Uint8Array, size: number): Uint8Array | undefined {
  const out = new Uint8Array(size);
  let at = 0;
  let written = 0;
  while (at < packed.length) {
    const control = packed[at++]!;
    if (control < 32) {
      const length = control + 1;
      if (at + length > packed.length || written + length > size) return undefined;
      out.set(packed.subarray(at, at + length), written);
      at += length;
      written += length;
      continue;
    }
    let length = control >> 5;
    if (length === 7) length += packed[at++] ?? NaN;
    const from = written - ((control & 31) << 8) - (packed[at++] ?? NaN) - 1;
    length += 2;
    if (!(from >= 0) || !(written + length <= size)) return undefined;
    for (let i = 0; i < length; ++i) out[written + i] = out[from + i]!;
    written += length;
  }
  return written === size ? out : undefined;
}
