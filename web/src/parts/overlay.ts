// SPDX-License-Identifier: Apache-2.0
// A hit laid on its query: the way from beside to on top of it, in colours that tell what matches.
import { Matrix4, Vector3 } from 'three';

import { frameOf, movedFrame, normalised } from '../cloud/cloud';
import type { Placement } from '../cloud/motion';
import { alignedPlacement, besidePlacement, between } from '../cloud/motion';
import { coloured, heatColour, kGrey, kHit, kQuery, segmentColour } from '../cloud/palette';
import { fill, h, newId } from '../dom';
import { percent } from '../text';
import type { Layer, Viewer } from '../view/viewer';
import { distancesBetween } from '../work';
import { swatch } from '../pages/shape';
import { pictureHint, viewerIn } from './large_picture';
import type { SegmentedCloud } from './points';
import type { Explanation, Motion } from '../../gen/shapedb/v1/search_service_pb';

const kAside = 1.1;  // diagonals
/** Distances shown in the last colour, as a share of the query's diagonal. */
const kFarthest = 0.05;
const kPairsTold = 7;

type Colouring = 'pair' | 'segments' | 'distance';
const kColourings: Record<Colouring, string> = {
  pair: 'query and hit', segments: 'matched segments', distance: 'distance',
};

export interface OverlayInput {
  queryName: string;
  hitName: string;
  query: SegmentedCloud;
  hit: SegmentedCloud;
  /** Undefined: they were not laid on each other, and are shown side by side. */
  motion: Motion | undefined;
  explanation: Explanation | undefined;
}

/** Fills `place` with the picture and its controls. */
export function fillOverlay(place: HTMLElement, input: OverlayInput, signal: AbortSignal): void {
  const stage = h('div', { class: 'stage' });
  const viewer = viewerIn(stage, `${input.hitName} laid on ${input.queryName}`, signal);
  if (viewer === null) return fill(place, stage);
  const overlay = new Overlay(viewer, input);
  fill(place, stage, overlay.controls(), overlay.legend, pictureHint());
  overlay.show();
}

class Overlay {
  private readonly told = h('ul', { class: 'legend row' });
  readonly legend = h('div', { role: 'status' }, this.told);
  private readonly points: { query: Float32Array; hit: Float32Array };
  private readonly layers: { query: Layer; hit: Layer };
  private readonly before = besidePlacement(kAside);
  private readonly after: Placement;
  private share = 1;
  private colouring: Colouring = 'pair';
  private split = false;
  private distances: Promise<[Float32Array, Float32Array]> | undefined;

  constructor(private readonly viewer: Viewer, private readonly input: OverlayInput) {
    const queryFrame = frameOf(input.query.positions);
    const hitFrame = frameOf(input.hit.positions);
    this.points = {
      query: normalised(input.query.positions, queryFrame), hit: normalised(input.hit.positions, hitFrame),
    };
    this.after = input.motion === undefined ? this.before : alignedPlacement(
      input.motion, movedFrame(hitFrame, input.hit.origin), movedFrame(queryFrame, input.query.origin));
    const blank = (cloud: SegmentedCloud) => coloured(cloud.segments.length, () => kGrey);
    this.layers = {
      query: viewer.addLayer(this.points.query, blank(input.query)),
      hit: viewer.addLayer(this.points.hit, blank(input.hit)),
    };
    this.layers.query.setMatrix(new Matrix4());
  }

  show(): void {
    this.place();
    this.look();
    void this.paint();
  }

  controls(): HTMLElement {
    const id = newId();
    const slider = h('input', {
      type: 'range', id, min: 0, max: 100, value: 100, class: 'between', 'aria-label': 'From beside to aligned',
      oninput: () => {
        this.share = Number(slider.value) / 100;
        this.place();
      },
      onchange: () => this.look(),
    });
    const split = h('input', {
      type: 'checkbox', onchange: () => {
        this.split = split.checked;
        this.place();
        this.look();
      },
    });
    const aligned = this.input.motion !== undefined;
    const shown = (name: string, layer: Layer) => {
      const box = h('input', { type: 'checkbox', checked: true, onchange: () => layer.setVisible(box.checked) });
      return h('label', { class: 'switch' }, box, name);
    };
    return h('div', { class: 'overlay-controls' },
      aligned && h('label', { class: 'slider', for: id }, 'as scanned', slider, 'aligned'),
      this.colourChoice(),
      h('span', { class: 'switches' }, shown('query', this.layers.query), shown('hit', this.layers.hit),
        h('label', { class: 'switch' }, split, 'side by side')));
  }

  private colourChoice(): HTMLElement {
    const name = newId();
    const offered = (Object.keys(kColourings) as Colouring[])
      .filter((one) => one !== 'distance' || this.input.motion !== undefined);
    return h('fieldset', { class: 'choice' }, h('legend', {}, 'Colours'), ...offered.map((colouring) => {
      const box = h('input', {
        type: 'radio', name, value: colouring, checked: colouring === this.colouring, onchange: () => {
          this.colouring = colouring;
          void this.paint();
        },
      });
      return h('label', {}, box, kColourings[colouring]);
    }));
  }

  private place(): void {
    const share = this.split ? 1 : this.share;
    // In a view of its own an unaligned hit need not stand aside.
    const target = this.split && this.input.motion === undefined ? besidePlacement(0) : this.after;
    this.layers.hit.setMatrix(between(this.before, target, share));
    this.viewer.setSplit(this.split);
  }

  private look(): void {
    this.viewer.look();
  }

  private async paint(): Promise<void> {
    if (this.colouring === 'distance') return this.paintDistances();
    const { query, hit } = this.input;
    if (this.colouring === 'pair') {
      this.layers.query.setColours(coloured(query.segments.length, () => kQuery));
      this.layers.hit.setColours(coloured(hit.segments.length, () => kHit));
      fill(this.told, h('li', {}, swatch(kQuery), `query: ${this.input.queryName}`),
        h('li', {}, swatch(kHit), `hit: ${this.input.hitName}`));
      return;
    }
    const { ofQuery, ofHit, pairs } = matchedColours(this.input.explanation);
    const colours = (cloud: SegmentedCloud, of: Map<number, number>) => coloured(cloud.segments.length, (i) => {
      const pair = of.get(cloud.segments[i]!);
      return pair === undefined ? kGrey : segmentColour(pair);
    });
    this.layers.query.setColours(colours(query, ofQuery));
    this.layers.hit.setColours(colours(hit, ofHit));
    fill(this.told, ...pairs.slice(0, kPairsTold).map((share, pair) =>
      h('li', {}, swatch(segmentColour(pair)), `pair ${pair + 1}: ${percent(share)} of the match`)),
      pairs.length > kPairsTold && h('li', {}, `and ${pairs.length - kPairsTold} smaller pairs`),
      h('li', {}, swatch(kGrey), pairs.length === 0 ? 'no segment matches' : 'unmatched'));
  }

  private async paintDistances(): Promise<void> {
    fill(this.told, h('li', {}, 'Distances are being measured'));
    this.distances ??= this.measure();
    const [query, hit] = await this.distances;
    if (this.colouring !== 'distance') return;
    const paint = (distances: Float32Array) =>
      coloured(distances.length, (i) => heatColour(distances[i]! / kFarthest));
    this.layers.query.setColours(paint(query));
    this.layers.hit.setColours(paint(hit));
    const near = query.filter((distance) => distance < kFarthest / 5).length / query.length;
    fill(this.told, h('li', {}, 'touching ', h('span', { class: 'heat', 'aria-hidden': 'true' }),
      ` ${percent(kFarthest)} of the query's size or more apart`),
      h('li', {}, `${percent(near)} of the query is nearer than ${percent(kFarthest / 5)}`));
  }

  private async measure(): Promise<[Float32Array, Float32Array]> {
    const matrix = between(this.before, this.after, 1);
    const moved = this.points.hit.slice();
    const point = new Vector3();
    for (let i = 0; i < moved.length; i += 3) point.fromArray(moved, i).applyMatrix4(matrix).toArray(moved, i);
    return Promise.all([
      distancesBetween(this.points.query, moved, kFarthest),
      distancesBetween(moved, this.points.query, kFarthest),
    ]);
  }
}

/** Which pair of the match a segment belongs to, and the share of each pair. */
function matchedColours(explanation: Explanation | undefined) {
  const ofQuery = new Map<number, number>();
  const ofHit = new Map<number, number>();
  const pairs: number[] = [];
  for (const { querySegment, hitSegment, share } of explanation?.matches ?? []) {
    ofQuery.set(querySegment, pairs.length);
    ofHit.set(hitSegment, pairs.length);
    pairs.push(share);
  }
  return { ofQuery, ofHit, pairs };
}
