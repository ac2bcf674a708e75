// SPDX-License-Identifier: Apache-2.0
// What the readers of formats produce: vertices in double precision, and triangles.
import { FileFault } from './fault';

/** Numbers that arrive one by one. */
class Numbers<A extends Float64Array | Uint32Array> {
  length = 0;
  constructor(private array: A, private readonly make: (length: number) => A) {}

  push(a: number, b: number, c: number): void {
    if (this.length + 3 > this.array.length) {
      const larger = this.make(2 * this.array.length);
      larger.set(this.array);
      this.array = larger;
    }
    this.array[this.length++] = a;
    this.array[this.length++] = b;
    this.array[this.length++] = c;
  }

  taken(): A {
    return this.array.subarray(0, this.length) as A;
  }
}

export class Content {
  /** Points of a PCD file whose coordinates say that nothing was measured there. */
  skipped = 0;
  /** Of the file that may have been faces, but could not be. */
  ignored: string[] = [];
  private readonly points = new Numbers(new Float64Array(3 << 10), (length) => new Float64Array(length));
  private readonly corners = new Numbers(new Uint32Array(3 << 10), (length) => new Uint32Array(length));

  get vertexCount(): number { return this.points.length / 3; }
  get vertices(): Float64Array { return this.points.taken(); }
  get triangleCount(): number { return this.corners.length / 3; }
  get triangles(): Uint32Array { return this.corners.taken(); }

  /** `where`: "line 7" or "byte 132". */
  addVertex(x: number, y: number, z: number, where: () => string): void {
    if (!Number.isFinite(x) || !Number.isFinite(y) || !Number.isFinite(z)) {
      throw new FileFault(`${where()}: vertex ${this.vertexCount} has a coordinate that is NaN or infinite; remove the vertex`,
        'non_finite_coordinate');
    }
    this.points.push(x, y, z);
  }

  /** Triangles with a repeated vertex stitch strips together; they have no area. */
  addTriangle(a: number, b: number, c: number): void {
    if (a !== b && b !== c && c !== a) this.corners.push(a, b, c);
  }
}

/** Splits polygons into triangles as their corners arrive, or strips, of which every second one is wound the other way. */
export class Corners {
  private count = 0;
  private first = 0;
  private last = 0;

  constructor(private readonly to: { addTriangle(a: number, b: number, c: number): void }, private readonly strips = false) {}

  begin(): void {
    this.count = 0;
  }

  add(vertex: number): void {
    if (this.count === 0) this.first = vertex;
    if (this.count >= 2) {
      const swapped = this.strips && this.count % 2 === 1;
      if (swapped) this.to.addTriangle(this.last, this.first, vertex);
      else this.to.addTriangle(this.first, this.last, vertex);
      if (this.strips) this.first = this.last;
    }
    this.last = vertex;
    ++this.count;
  }
}
