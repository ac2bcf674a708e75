// SPDX-License-Identifier: Apache-2.0
// How far each point of one cloud is from the nearest of another.

/** Cells in the largest distance that counts. */
const kRings = 5;
const kSpan = 2048;  // cells along an axis: clouds are about the origin and about 1 across

/** The points of a cloud by cubic cells. */
class Grid {
  private readonly cells = new Map<number, number[]>();

  constructor(private readonly points: Float32Array, private readonly side: number) {
    for (let i = 0; i < points.length; i += 3) {
      const name = this.nameOf(this.cellOf(points[i]!), this.cellOf(points[i + 1]!), this.cellOf(points[i + 2]!));
      const cell = this.cells.get(name);
      if (cell === undefined) this.cells.set(name, [i]);
      else cell.push(i);
    }
  }

  /** The squared distance to the nearest point; `most` squared if there is none as near as that. */
  nearest(x: number, y: number, z: number, most: number): number {
    const [cx, cy, cz] = [this.cellOf(x), this.cellOf(y), this.cellOf(z)];
    let least = most * most;
    for (let ring = 0; ring <= kRings; ++ring) {
      // Whatever is in this ring is at least so far away.
      const closest = Math.max(ring - 1, 0) * this.side;
      if (closest * closest >= least) break;
      for (let dx = -ring; dx <= ring; ++dx) {
        for (let dy = -ring; dy <= ring; ++dy) {
          const step = Math.max(Math.abs(dx), Math.abs(dy)) === ring ? 1 : 2 * ring;
          for (let dz = -ring; dz <= ring; dz += Math.max(step, 1)) {
            least = this.leastIn(this.nameOf(cx + dx, cy + dy, cz + dz), x, y, z, least);
          }
        }
      }
    }
    return least;
  }

  private leastIn(name: number, x: number, y: number, z: number, least: number): number {
    for (const j of this.cells.get(name) ?? []) {
      const squared = (this.points[j]! - x) ** 2 + (this.points[j + 1]! - y) ** 2 + (this.points[j + 2]! - z) ** 2;
      if (squared < least) least = squared;
    }
    return least;
  }

  private cellOf(value: number): number {
    return Math.floor(value / this.side) + kSpan / 2;
  }

  private nameOf(x: number, y: number, z: number): number {
    return (x * kSpan + y) * kSpan + z;
  }
}

/** Distances up to `most`, which stands for all that are farther. Both clouds in the same frame, about 1 across. */
export function distancesTo(from: Float32Array, to: Float32Array, most: number): Float32Array {
  const grid = new Grid(to, most / kRings);
  const out = new Float32Array(from.length / 3);
  for (let i = 0; i < out.length; ++i) {
    out[i] = Math.sqrt(grid.nearest(from[3 * i]!, from[3 * i + 1]!, from[3 * i + 2]!, most));
  }
  return out;
}
