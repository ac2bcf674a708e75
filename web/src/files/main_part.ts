// SPDX-License-Identifier: Apache-2.0
// Where the points of a scan lie, whatever a few outliers do, as core/geometry/main_part.h tells.

export interface Axis {
  low: number;
  high: number;
}

export interface MainPart {
  /** Of the points that are no outliers. */
  axes: Axis[];
  points: number;
  outliers: number;
}

const kReach = 4;
const kSample = 65536;
const kShares = [0.25, 0.1, 0.01];

export const extentOf = ({ low, high }: Axis) => high - low;
export const sizeOf = (axes: Axis[]) => Math.hypot(...axes.map(extentOf));
export const isPoint = ({ axes }: MainPart) => axes.every(({ low, high }) => low === high);

/** The box of the vertices that `holds` takes. */
export function axesOf(vertices: Float64Array, holds: (first: number) => boolean = () => true): Axis[] {
  const axes = [0, 1, 2].map(() => ({ low: Infinity, high: -Infinity }));
  for (let i = 0; i < vertices.length; i += 3) {
    if (!holds(i)) continue;
    axes.forEach((axis, j) => {
      const value = vertices[i + j]!;
      if (value < axis.low) axis.low = value;
      if (value > axis.high) axis.high = value;
    });
  }
  return axes;
}

/** Of every coordinate of the sample the values in ascending order. */
function sortedSample(vertices: Float64Array): Float64Array[] {
  const count = vertices.length / 3;
  const step = Math.ceil(count / kSample);
  return [0, 1, 2].map((axis) => {
    const values = Float64Array.from({ length: Math.ceil(count / step) }, (_, i) => vertices[3 * i * step + axis]!);
    return values.sort();
  });
}

function reachOf(sample: Float64Array[], share: number): Axis[] {
  const middle = sample.map((values) => {
    const leftOut = Math.trunc(share * (values.length - 1));
    return { low: values[leftOut]!, high: values[values.length - 1 - leftOut]! };
  });
  const reach = kReach * sizeOf(middle);
  if (reach === 0) return middle;
  return middle.map(({ low, high }) => ({ low: 0.5 * low + 0.5 * high - reach, high: 0.5 * low + 0.5 * high + reach }));
}

/** `vertices`: finite, at least one. */
export function mainPartOf(vertices: Float64Array): MainPart {
  const count = vertices.length / 3;
  const sample = sortedSample(vertices);
  let point: MainPart | undefined;
  for (const share of kShares) {
    const reach = reachOf(sample, share);
    let points = 0;
    const axes = axesOf(vertices, (first) => {
      const holds = reach.every(({ low, high }, axis) => vertices[first + axis]! >= low && vertices[first + axis]! <= high);
      if (holds) ++points;
      return holds;
    });
    const part = { axes, points, outliers: count - points };
    if (2 * points <= count) continue;
    if (!isPoint(part)) return part;
    point = part;
  }
  return point ?? { axes: axesOf(vertices), points: count, outliers: 0 };
}
