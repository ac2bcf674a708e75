// SPDX-License-Identifier: Apache-2.0
// How finely single precision holds the coordinates of a scan, as core/geometry/resolution.h tells.
import type { Point } from '../cloud/cloud';
import { countText, FileFault } from './fault';
import { type Axis, axesOf, extentOf, isPoint, mainPartOf, sizeOf } from './main_part';

const kLargestSingle = 3.4028234663852886e38;
/** 2^24 times the smallest normal number: below this diagonal detail is lost to subnormals. */
const kSmallestDiagonal = 2 ** -126 * 2 ** 24;
const kLeastSteps = 1000;
const kLeastStepsOfAxis = 64;
const kFarFromOrigin = 16;
const kFlatShare = 1e-6;
const kLeastOddShare = 0.125;

const largestOf = ({ low, high }: Axis) => Math.max(Math.abs(low), Math.abs(high));

/** From the magnitude to the next number of single precision. */
function stepAt(magnitude: number): number {
  const single = new Float32Array([Math.min(magnitude, kLargestSingle)]);
  const bits = new Uint32Array(single.buffer);
  const from = single[0]!;
  if (from >= kLargestSingle) return 2 ** 104;
  ++bits[0]!;
  return single[0]! - from;
}

interface Coarse {
  largest: number;
  step: number;
  across: number;
}

/** Why single precision cannot hold so many points there; undefined if it can. */
function coarse(axes: Axis[], points: number): Coarse | undefined {
  const size = sizeOf(axes);
  const largest = Math.max(...axes.map(largestOf));
  const step = stepAt(largest);
  if (size > 0 && step * Math.max(kLeastSteps, Math.sqrt(points)) > size) return { largest, step, across: size };
  for (const axis of axes) {
    const extent = extentOf(axis);
    const own = stepAt(largestOf(axis));
    if (extent > kFlatShare * size && own * kLeastStepsOfAxis > extent) return { largest: largestOf(axis), step: own, across: extent };
  }
  return undefined;
}

/**
 * Refuses vertices that were rounded to single precision where that cannot hold them: what is left is not the shape that
 * was scanned. Vertices on a coarser grid lost nothing and pass.
 */
export function checkNotRounded(vertices: Float64Array): void {
  if (vertices.length === 0 || axesOf(vertices).some((axis) => largestOf(axis) > kLargestSingle)) return;
  if (!vertices.every((value) => Math.fround(value) === value)) return;
  const part = mainPartOf(vertices);
  const found = coarse(part.axes, part.points);
  if (found === undefined) return;
  let odd = 0;
  for (let i = 0; i < vertices.length; i += 3) {
    const point = vertices.subarray(i, i + 3);
    if (point.some((value) => stepAt(Math.abs(value)) >= found.step && value % (2 * found.step) !== 0)) ++odd;
  }
  if (odd < (kLeastOddShare * vertices.length) / 3) return;
  const text = (value: number, digits: number) => Number(value.toPrecision(digits)).toString();
  const without = part.outliers > 0 ? `, without ${countText(part.outliers, 'point')} far from the others` : '';
  throw new FileFault(`coordinates up to ${text(found.largest, 6)} are ${text(found.step, 3)} apart in single precision, but the ` +
    `scan is only ${text(found.across, 3)} across${without}, and all of them are such numbers: the shape was lost when they were written in ` +
    'single precision. Write them again in double precision, or relative to a point near the scan', 'coordinate_out_of_range');
}

/**
 * What to subtract from the points before they become single precision: the middle of their box, without outliers, if they
 * lie so far from 0, 0, 0 that rounding would hurt their shape.
 */
export function originOf(vertices: Float64Array): Point {
  const all = axesOf(vertices);
  const whole = sizeOf(all);
  const beyond = vertices.findIndex((value) => Math.abs(value) > kLargestSingle);
  if (beyond >= 0) {
    throw new FileFault(`point ${Math.floor(beyond / 3)} has a coordinate beyond single precision (3.4e38); use a larger unit`,
      'coordinate_out_of_range');
  }
  if (whole > 0 && whole < kSmallestDiagonal) {
    throw new FileFault(`the whole scan is only ${whole.toPrecision(3)} across, too small for single precision; use a smaller unit`,
      'coordinate_out_of_range');
  }
  if (vertices.length === 0) return [0, 0, 0];
  const part = mainPartOf(vertices);
  const [axes, points] = isPoint(part) ? [all, vertices.length / 3] : [part.axes, part.points];
  const size = sizeOf(axes);
  const far = size > 0 && Math.max(...axes.map(largestOf)) > kFarFromOrigin * size;
  if (!far && coarse(axes, points) === undefined) return [0, 0, 0];
  return axes.map((axis) => axis.low + 0.5 * extentOf(axis)) as Point;
}

/** The points relative to the origin, subtracted in double precision. */
export function relativeTo(vertices: Float64Array, origin: Point): Float32Array {
  const positions = new Float32Array(vertices.length);
  for (let i = 0; i < vertices.length; ++i) positions[i] = vertices[i]! - origin[i % 3]!;
  return positions;
}
