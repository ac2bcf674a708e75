// SPDX-License-Identifier: Apache-2.0

const kFree = 0xffffffff;
const kLeastPlaces = 1024;

/** Finds the vertex at a position, by open addressing: a map of texts would take most of the time of a large file. */
export class VertexTable {
  private places = new Uint32Array(0);  // a power of two, at most half used
  private readonly number = new Float64Array(3);
  private readonly bits = new Uint32Array(this.number.buffer);

  /** The vertex at the position, of `count` in `vertices`. undefined if none: it gets the number `count`, to be added now. */
  place(x: number, y: number, z: number, vertices: Float64Array, count: number): number | undefined {
    if (2 * count >= this.places.length) this.grow(vertices, count);
    const at = this.find(x, y, z, vertices);
    const known = this.places[at]!;
    if (known !== kFree) return known;
    this.places[at] = count;
    return undefined;
  }

  private find(x: number, y: number, z: number, vertices: Float64Array): number {
    // Adding zero turns -0 into 0: they are equal and must hash alike.
    this.number[0] = x + 0;
    this.number[1] = y + 0;
    this.number[2] = z + 0;
    let hash = 0;
    for (const word of this.bits) {
      hash = Math.imul(hash ^ word, 0x9e3779b1);
      hash ^= hash >>> 15;
    }
    const last = this.places.length - 1;
    for (let at = hash & last; ; at = (at + 1) & last) {
      const vertex = this.places[at]!;
      if (vertex === kFree) return at;
      if (vertices[3 * vertex] === x && vertices[3 * vertex + 1] === y && vertices[3 * vertex + 2] === z) return at;
    }
  }

  private grow(vertices: Float64Array, count: number): void {
    this.places = new Uint32Array(Math.max(kLeastPlaces, 2 * this.places.length)).fill(kFree);
    for (let v = 0; v < count; ++v) {
      this.places[this.find(vertices[3 * v]!, vertices[3 * v + 1]!, vertices[3 * v + 2]!, vertices)] = v;
    }
  }
}
