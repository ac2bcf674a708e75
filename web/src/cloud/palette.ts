// SPDX-License-Identifier: Apache-2.0
// Colours of points: segments, the two sides of a comparison, distances. RGB, 0 to 255.
export type Rgb = readonly [number, number, number];

/** Told apart by most people who see few colours (Okabe and Ito 2008), then lighter and darker ones. */
export const kSegmentColours: readonly Rgb[] = [
  [0, 114, 178], [230, 159, 0], [0, 158, 115], [204, 121, 167], [86, 180, 233], [213, 94, 0], [190, 180, 40],
  [120, 94, 200], [60, 140, 140], [170, 80, 90], [110, 160, 60], [90, 110, 150], [222, 170, 200], [128, 84, 40],
  [170, 220, 160], [60, 60, 140],
];
export const kGrey: Rgb = [150, 155, 162];
export const kQuery: Rgb = [46, 117, 214];
export const kHit: Rgb = [232, 122, 40];

export function segmentColour(segment: number): Rgb {
  return segment < 0 ? kGrey : kSegmentColours[segment % kSegmentColours.length]!;
}

/** From unlike (dark) to alike (bright): part of viridis. */
const kLikeness: readonly Rgb[] = [[68, 1, 84], [59, 82, 139], [33, 145, 140], [94, 201, 98], [253, 231, 37]];

/** `value` in [0, 1]. */
export function likenessColour(value: number): Rgb {
  return ramp(kLikeness, value);
}

/** From near (blue) over yellow to far (red). */
const kHeat: readonly Rgb[] = [[40, 90, 200], [60, 180, 190], [250, 220, 90], [240, 130, 40], [190, 20, 40]];

/** `share` of the largest distance shown, [0, 1]. */
export function heatColour(share: number): Rgb {
  return ramp(kHeat, share);
}

function ramp(colours: readonly Rgb[], share: number): Rgb {
  const at = Math.min(Math.max(share, 0), 1) * (colours.length - 1);
  const below = Math.min(Math.floor(at), colours.length - 2);
  const mix = (i: 0 | 1 | 2) => colours[below]![i] + (colours[below + 1]![i] - colours[below]![i]) * (at - below);
  return [mix(0), mix(1), mix(2)];
}

/** One colour for each of `count` points. */
export function coloured(count: number, colourOf: (point: number) => Rgb): Uint8Array {
  const out = new Uint8Array(3 * count);
  for (let i = 0; i < count; ++i) {
    const [r, g, b] = colourOf(i);
    out[3 * i] = r;
    out[3 * i + 1] = g;
    out[3 * i + 2] = b;
  }
  return out;
}
