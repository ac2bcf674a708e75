// SPDX-License-Identifier: Apache-2.0
// Small pictures of shapes, splatted by hand: a wall of them needs no WebGL context, and each takes a millisecond.
import type { Positions } from '../cloud/cloud';
import { frameOf, normalised, spacingOf } from '../cloud/cloud';
import type { Rgb } from '../cloud/palette';

export interface Preview {
  positions: Positions;
  /** Three signed bytes a point, of either sign; empty: not known. */
  normals: Int8Array;
}

/** Radius of a point, in distances between points: so large that they close to a surface. */
const kOverlap = 1.35;
const kTilt = 0.42;  // radians from above
const kFill = 0.94;  // of the picture's side, by the farthest point: however it is turned

/** Draws the shape turned by `turn` radians about the vertical axis; the background stays transparent. */
export function drawThumbnail(canvas: HTMLCanvasElement, preview: Preview, turn: number, colour: Rgb): void {
  const side = canvas.width;
  const context = canvas.getContext('2d')!;
  const image = context.createImageData(side, side);
  const depth = new Float32Array(side * side).fill(-Infinity);
  const { centre, size } = frameOf(preview.positions);
  const scale = (kFill * side) / (2 * reachOf(preview.positions, centre));
  const count = preview.positions.length / 3;
  const radius = Math.max(1.5, kOverlap * spacingOf(normalised(preview.positions, { centre, size })) * size * scale);
  const [ct, st, ch, sh] = [Math.cos(turn), Math.sin(turn), Math.cos(kTilt), Math.sin(kTilt)];
  /** Right, up, and towards the eye; z is up in scans. */
  const seen = (x: number, y: number, z: number): [number, number, number] => {
    const [rx, ry] = [ct * x - st * y, st * x + ct * y];
    return [rx, ch * z + sh * ry, sh * z - ch * ry];
  };
  for (let i = 0; i < count; ++i) {
    const [x, y, z] = seen(
      preview.positions[3 * i]! - centre[0], preview.positions[3 * i + 1]! - centre[1],
      preview.positions[3 * i + 2]! - centre[2]);
    const light = lightOf(preview, i, seen, (z / size) * 2);
    splat(image, depth, side / 2 + scale * x, side / 2 - scale * y, scale * z, radius, light, colour);
  }
  context.putImageData(image, 0, 0);
}

/** The largest distance of a point from the centre. */
function reachOf(positions: Positions, centre: [number, number, number]): number {
  let most = 0;
  for (let i = 0; i < positions.length; i += 3) {
    const squared = (positions[i]! - centre[0]) ** 2 + (positions[i + 1]! - centre[1]) ** 2 +
      (positions[i + 2]! - centre[2]) ** 2;
    if (squared > most) most = squared;
  }
  return Math.sqrt(most) || 1;
}

/** How bright a point is, about 0.3 to 1; `height`: how near the eye, -1 to 1. */
function lightOf(
  preview: Preview,
  i: number,
  seen: (x: number, y: number, z: number) => [number, number, number],
  height: number,
): number {
  if (preview.normals.length === 0) return 0.75 + 0.3 * height;
  let [nx, ny, nz] = seen(
    preview.normals[3 * i]! / 127, preview.normals[3 * i + 1]! / 127, preview.normals[3 * i + 2]! / 127);
  if (nz < 0) [nx, ny, nz] = [-nx, -ny, -nz];  // what is seen faces the eye
  return 0.34 + 0.66 * Math.max(0, -0.35 * nx + 0.45 * ny + 0.82 * nz) + 0.08 * height;
}

function splat(
  image: ImageData, depth: Float32Array, cx: number, cy: number, z: number, radius: number, light: number, colour: Rgb,
): void {
  const side = image.width;
  for (let y = Math.max(0, Math.ceil(cy - radius)); y <= Math.min(side - 1, cy + radius); ++y) {
    for (let x = Math.max(0, Math.ceil(cx - radius)); x <= Math.min(side - 1, cx + radius); ++x) {
      const squared = (x - cx) ** 2 + (y - cy) ** 2;
      const at = y * side + x;
      // Paraboloids rather than discs: of two that overlap the nearer centre is seen.
      const height = z - squared / radius;
      if (squared > radius * radius || height <= depth[at]!) continue;
      depth[at] = height;
      for (let c = 0; c < 3; ++c) image.data[4 * at + c] = Math.min(255, colour[c]! * light);
      image.data[4 * at + 3] = 255;
    }
  }
}
