// SPDX-License-Identifier: Apache-2.0
// Points of shapes with their segments, for the large pictures.
import { call, follow } from '../api/connect';
import { isCancelled } from '../api/failure';
import { joinPositions, positionsFrom } from '../cloud/cloud';
import type { Point, Positions } from '../cloud/cloud';
import type { SegmentationReport, Signature } from '../../gen/shapedb/v1/types_pb';
import type { SegmentedPoints } from '../../gen/shapedb/v1/shape_service_pb';
import { ShapeService } from '../../gen/shapedb/v1/shape_service_pb';

function pointOf(vector: { x: number; y: number; z: number } | undefined): Point {
  return vector === undefined ? [0, 0, 0] : [vector.x, vector.y, vector.z];
}

/** Fetched at first: more than a screen resolves. */
export const kPointsAtFirst = 60_000;

export interface SegmentedCloud {
  positions: Positions;
  /** Of each point: 0 is the largest segment, -1 none. */
  segments: Int32Array;
  /** What the positions are relative to, in double precision. */
  origin: Point;
  report?: SegmentationReport;
  signature?: Signature;
}

export function cloudFrom(answers: SegmentedPoints[]): SegmentedCloud {
  const cloud: SegmentedCloud = { positions: new Float32Array(), segments: new Int32Array(), origin: pointOf(undefined) };
  const positions: Positions[] = [];
  const segments: Int32Array[] = [];
  for (const { part } of answers) {
    if (part.case === 'summary') {
      if (part.value.report !== undefined) cloud.report = part.value.report;
      cloud.origin = pointOf(part.value.origin);
      if (part.value.signature !== undefined) cloud.signature = part.value.signature;
    } else if (part.case === 'chunk') {
      positions.push(positionsFrom(part.value.xyz));
      segments.push(Int32Array.from(part.value.segments));
    }
  }
  cloud.positions = joinPositions(positions);
  cloud.segments = new Int32Array(cloud.positions.length / 3).fill(-1);
  let at = 0;
  for (const one of segments) {
    cloud.segments.set(one, at);
    at += one.length;
  }
  return cloud;
}

/** `most` points of a stored shape (0: all) with their segments; without them if it cannot be segmented. */
export async function storedCloud(
  collection: string, key: string, most: number, signal: AbortSignal,
): Promise<SegmentedCloud> {
  const shape = { collection, key };
  const maxPoints = BigInt(most);
  try {
    const answers: SegmentedPoints[] = [];
    await follow(ShapeService.method.getSegments, { shape, maxPoints }, (answer) => answers.push(answer), { signal });
    return cloudFrom(answers);
  } catch (error) {
    if (isCancelled(error)) throw error;
    const parts: Positions[] = [];
    let origin = pointOf(undefined);
    await follow(ShapeService.method.getPoints, { shape, maxPoints }, (answer) => {
      if (answer.part.case === 'shape') origin = pointOf(answer.part.value.origin);
      if (answer.part.case === 'chunk') parts.push(positionsFrom(answer.part.value.xyz));
    }, { signal });
    const positions = joinPositions(parts);
    return { positions, segments: new Int32Array(positions.length / 3).fill(-1), origin };
  }
}

export async function storedShape(collection: string, key: string, signal: AbortSignal) {
  const { shape } = await call(ShapeService.method.getShape, { shape: { collection, key } }, { signal });
  return shape!;
}
