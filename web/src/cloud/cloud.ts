// SPDX-License-Identifier: Apache-2.0
// Points as they are drawn and sent.

/** x y z, x y z, ... as the server has them. */
export type Positions = Float32Array;

export type Point = [number, number, number];

/** Where a cloud lies and how large it is, in its own units. */
export interface Frame {
  centre: Point;
  /** Diagonal of the box of the points, above 0. */
  size: number;
}

export function pointCount(positions: Positions): number {
  return positions.length / 3;
}

/** Of points that are not all the same; otherwise the size is 1. */
export function frameOf(positions: Positions): Frame {
  const low = [Infinity, Infinity, Infinity];
  const high = [-Infinity, -Infinity, -Infinity];
  for (let i = 0; i < positions.length; ++i) {
    const value = positions[i]!;
    const axis = i % 3;
    if (value < low[axis]!) low[axis] = value;
    if (value > high[axis]!) high[axis] = value;
  }
  if (positions.length === 0) return { centre: [0, 0, 0], size: 1 };
  const middle = (axis: number) => (low[axis]! + high[axis]!) / 2;
  const size = Math.hypot(high[0]! - low[0]!, high[1]! - low[1]!, high[2]! - low[2]!);
  return { centre: [middle(0), middle(1), middle(2)], size: size > 0 ? size : 1 };
}

/** The frame in the client's own coordinates, of points that are relative to `origin`. */
export function movedFrame(frame: Frame, origin: Point): Frame {
  const [x, y, z] = frame.centre;
  return { ...frame, centre: [x + origin[0], y + origin[1], z + origin[2]] };
}

/** The points in their frame: about the origin, with a diagonal of 1. */
export function normalised(positions: Positions, frame: Frame): Float32Array {
  const out = new Float32Array(positions.length);
  for (let i = 0; i < out.length; ++i) out[i] = (positions[i]! - frame.centre[i % 3]!) / frame.size;
  return out;
}

/** Little-endian float32, as the wire has them. */
export function positionsFrom(bytes: Uint8Array): Positions {
  return new Float32Array(bytes.slice().buffer);
}

export function joinPositions(parts: Positions[]): Positions {
  const all = new Float32Array(parts.reduce((sum, part) => sum + part.length, 0));
  let at = 0;
  for (const part of parts) {
    all.set(part, at);
    at += part.length;
  }
  return all;
}

/** How far points are from their neighbours on the surface, in a cloud in its frame. */
export function spacingOf(points: Float32Array): number {
  const kCells = 48;  // along the diagonal
  const occupied = new Set<number>();
  const cellOf = (value: number) => Math.floor((value + 1) * kCells);
  for (let i = 0; i < points.length; i += 3) {
    occupied.add((cellOf(points[i]!) * 4 * kCells + cellOf(points[i + 1]!)) * 4 * kCells + cellOf(points[i + 2]!));
  }
  // A surface that crosses a cell at random takes about two thirds of a side's square of it, and few points take less.
  const area = (0.67 * occupied.size) / (kCells * kCells);
  return Math.sqrt(area / Math.max(pointCount(points), 1));
}

const kChunkPoints = 80_000;  // below 1 MiB

/** The points as chunks of an upload. */
export function* chunksOf(positions: Positions): Generator<Uint8Array> {
  const bytes = new Uint8Array(positions.buffer, positions.byteOffset, positions.byteLength);
  for (let at = 0; at < bytes.length; at += 12 * kChunkPoints) yield bytes.subarray(at, at + 12 * kChunkPoints);
}

/** At most `most` of the points, evenly over their order. */
export function thinned(positions: Positions, most: number): Positions {
  const count = pointCount(positions);
  if (count <= most) return positions;
  const out = new Float32Array(3 * most);
  for (let i = 0; i < most; ++i) {
    const from = 3 * Math.floor((i * count) / most);
    out.set(positions.subarray(from, from + 3), 3 * i);
  }
  return out;
}
