// SPDX-License-Identifier: Apache-2.0
// One shape: its points coloured by segment, what is known of it, and what is like it.
import { Matrix4 } from 'three';

import type { Address } from '../address';
import { linkTo } from '../address';
import { normalised, frameOf, pointCount } from '../cloud/cloud';
import { coloured, segmentColour } from '../cloud/palette';
import { fill, h } from '../dom';
import { count, moment, percent, stateName } from '../text';
import { givenMetadata } from '../parts/card';
import { facts } from '../parts/facts';
import { pictureHint, viewerIn } from '../parts/large_picture';
import type { SegmentedCloud } from '../parts/points';
import { kPointsAtFirst, storedCloud, storedShape } from '../parts/points';
import { failed, fillWhenLoaded, loading } from '../parts/status';
import type { View } from '../view';
import type { Shape } from '../../gen/shapedb/v1/types_pb';
import { ShapeState } from '../../gen/shapedb/v1/types_pb';

export function shapeView(address: Address, signal: AbortSignal): View {
  const key = address.keys[0] ?? '';
  const stage = h('div', { class: 'stage' });
  const about = h('div', { class: 'panel' });
  const picture = h('div', {}, stage, pictureHint());
  const element = h('div', { class: 'with-panel' },
    h('div', { class: 'content' }, h('h1', {}, key), picture), about);
  void fillWhenLoaded(about, 'The shape is being read', signal, async () => {
    picture.hidden = true;
    const shape = await storedShape(address.collection, key, signal);
    picture.hidden = false;
    void draw(stage, about, shape, kPointsAtFirst, signal);
    return aboutShape(shape, address);
  });
  return { title: key, element };
}

function aboutShape(shape: Shape, address: Address): HTMLElement[] {
  const ready = shape.state === ShapeState.READY;
  const parts = [
    h('p', {}, h('a', { class: 'button primary', href: linkTo(address, 'like', [shape.key]) }, 'Find shapes like this')),
    facts([
      ['state', stateName(shape.state)],
      ['points', count(shape.pointCount)],
      ['quality', shape.quality === undefined ? '' : qualityText(shape.quality)],
      ['changed', moment(shape.updated)],
      ['version', String(shape.version)],
    ]),
    h('h2', {}, 'Metadata'),
    givenMetadata(shape).length === 0 ? h('p', { class: 'faint' }, 'It has none.') : facts(givenMetadata(shape)),
    h('div', { class: 'segments-place' }),
  ];
  if (!ready) parts.shift();
  if (shape.failure !== undefined) {
    parts.unshift(h('div', { class: 'note bad' }, h('strong', {}, 'It could not be segmented: '), shape.failure.message));
  }
  return parts;
}

function qualityText(quality: number): string {
  return quality < 0.5 ? `${quality.toFixed(2)}: its interior is a guess` : quality.toFixed(2);
}

async function draw(
  stage: HTMLElement, about: HTMLElement, shape: Shape, most: number, signal: AbortSignal,
): Promise<void> {
  fill(stage, loading('The points are being fetched and segmented'));
  try {
    const cloud = await storedCloud(shape.collection, shape.key, most, signal);
    if (signal.aborted) return;
    const viewer = viewerIn(stage, `${shape.key}, coloured by segment`, signal);
    if (viewer === null) return;
    showSegments(viewer, cloud);
    const place = about.querySelector<HTMLElement>('.segments-place');
    if (place !== null) fill(place, ...segmentList(cloud));
    if (pointCount(cloud.positions) < Number(shape.pointCount)) {
      const more = h('button', {
        type: 'button', class: 'over', onclick: () => void draw(stage, about, shape, 0, signal),
      }, `Show all ${count(shape.pointCount)} points`);
      stage.append(more);
    }
  } catch (error) {
    if (!signal.aborted) fill(stage, failed(error, () => void draw(stage, about, shape, most, signal)));
  }
}

export function showSegments(viewer: ReturnType<typeof viewerIn>, cloud: SegmentedCloud): void {
  if (viewer === null) return;
  const points = normalised(cloud.positions, frameOf(cloud.positions));
  viewer.clear();
  viewer.addLayer(points, coloured(cloud.segments.length, (i) => segmentColour(cloud.segments[i]!)))
    .setMatrix(new Matrix4());
  viewer.look();
}

/** The heaviest segments with their colours and shares of the volume. */
export function segmentList(cloud: SegmentedCloud): HTMLElement[] {
  const points = cloud.signature?.points ?? [];
  if (points.length === 0) return [];
  return [h('h2', {}, 'Segments'), h('ul', { class: 'legend' }, ...points.map((point, i) => h('li', {},
    swatch(segmentColour(i)), `segment ${i + 1}`, h('span', { class: 'faint' }, percent(point.volumeShare)))))];
}

export function swatch(colour: readonly [number, number, number]): HTMLElement {
  const mark = h('span', { class: 'swatch', 'aria-hidden': 'true' });
  mark.style.background = `rgb(${colour.join(' ')})`;
  return mark;
}
