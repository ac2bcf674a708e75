// SPDX-License-Identifier: Apache-2.0
// How a hit is laid on its query: y = scale * R x + t (proto Motion), between frames in which both have a diagonal of 1.
import { Matrix4, Quaternion, Vector3 } from 'three';

import type { Motion } from '../../gen/shapedb/v1/search_service_pb';
import type { Frame } from './cloud';

/** A motion in parts that can be gone through little by little. */
export interface Placement {
  turn: Quaternion;
  mirrored: boolean;
  scale: number;
  shift: Vector3;
}

/** Beside the query, as it was scanned: `aside` diagonals to the right. */
export function besidePlacement(aside: number): Placement {
  return { turn: new Quaternion(), mirrored: false, scale: 1, shift: new Vector3(aside, 0, 0) };
}

/** On the query, in the query's frame. */
export function alignedPlacement(motion: Motion, hit: Frame, query: Frame): Placement {
  const r = motion.rotation;
  const at = (row: number, column: number) => r[3 * row + column] ?? (row === column ? 1 : 0);
  // A reflection is a turn after the x axis has changed its sign.
  const sign = motion.reflected ? -1 : 1;
  const matrix = new Matrix4().set(
    sign * at(0, 0), at(0, 1), at(0, 2), 0,
    sign * at(1, 0), at(1, 1), at(1, 2), 0,
    sign * at(2, 0), at(2, 1), at(2, 2), 0,
    0, 0, 0, 1);
  const t = motion.translation ?? { x: 0, y: 0, z: 0 };
  const shift = [t.x, t.y, t.z].map((value, row) => {
    const moved = motion.scale * (at(row, 0) * hit.centre[0] + at(row, 1) * hit.centre[1] + at(row, 2) * hit.centre[2]);
    return (moved + value - query.centre[row]!) / query.size;
  });
  return {
    turn: new Quaternion().setFromRotationMatrix(matrix),
    mirrored: motion.reflected,
    scale: (motion.scale * hit.size) / query.size,
    shift: new Vector3(shift[0], shift[1], shift[2]),
  };
}

/** On the way from one placement to the other, `share` in [0, 1]. */
export function between(from: Placement, to: Placement, share: number): Matrix4 {
  const flip = (placement: Placement) => (placement.mirrored ? -1 : 1);
  const mirror = flip(from) + (flip(to) - flip(from)) * share;
  const scale = Math.exp(Math.log(from.scale) * (1 - share) + Math.log(to.scale) * share);
  const turn = new Quaternion().slerpQuaternions(from.turn, to.turn, share);
  const shift = new Vector3().lerpVectors(from.shift, to.shift, share);
  return new Matrix4().compose(shift, turn, new Vector3(scale * mirror, scale, scale));
}
