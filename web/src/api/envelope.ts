// SPDX-License-Identifier: Apache-2.0
// The Connect protocol's envelopes: a byte of flags, the length in four bytes (big-endian), and the message.

const kHeadBytes = 5;
const kEndOfStream = 2;

export interface Envelope {
  message: Uint8Array;
  /** The message is JSON that ends the stream. */
  last: boolean;
}

export function inEnvelope(message: Uint8Array): [Uint8Array<ArrayBuffer>, Uint8Array] {
  const head = new Uint8Array(kHeadBytes);
  new DataView(head.buffer).setUint32(1, message.length);
  return [head, message];
}

/** Takes envelopes out of bytes that arrive in any pieces. */
export class EnvelopeReader {
  private pieces: Uint8Array[] = [];
  private bytes = 0;

  /** The envelopes that these bytes complete. */
  add(piece: Uint8Array): Envelope[] {
    this.pieces.push(piece);
    this.bytes += piece.length;
    const complete: Envelope[] = [];
    while (this.bytes >= kHeadBytes) {
      const length = this.messageLength();
      if (this.bytes < kHeadBytes + length) break;
      const all = this.joined();
      complete.push({ message: all.slice(kHeadBytes, kHeadBytes + length), last: (all[0]! & kEndOfStream) !== 0 });
      this.pieces = [all.subarray(kHeadBytes + length)];
      this.bytes = all.length - kHeadBytes - length;
    }
    return complete;
  }

  private messageLength(): number {
    if (this.pieces[0]!.length < kHeadBytes) this.pieces = [this.joined()];
    const head = this.pieces[0]!;
    return new DataView(head.buffer, head.byteOffset).getUint32(1);
  }

  private joined(): Uint8Array {
    if (this.pieces.length === 1) return this.pieces[0]!;
    const all = new Uint8Array(this.bytes);
    let at = 0;
    for (const piece of this.pieces) {
      all.set(piece, at);
      at += piece.length;
    }
    return all;
  }
}
