// SPDX-License-Identifier: Apache-2.0
// A shape on the wall, and a hit among others.
import type { Address } from '../address';
import { linkTo } from '../address';
import { h } from '../dom';
import { count, percent, score, stateName, verdictClass, verdictName } from '../text';
import type { Hit } from '../../gen/shapedb/v1/search_service_pb';
import { Verdict } from '../../gen/shapedb/v1/search_service_pb';
import type { Shape } from '../../gen/shapedb/v1/types_pb';
import { ShapeState } from '../../gen/shapedb/v1/types_pb';
import { pictureOf } from './picture';
import { smallReasons } from './reasons';

/** Metadata that people gave; what clients note about the points is not among it. */
export function givenMetadata(shape: Shape): [string, string][] {
  return Object.entries(shape.metadata).filter(([key]) => !key.startsWith('shapedb.')).sort();
}

export function shapeCard(shape: Shape, address: Address, signal: AbortSignal): HTMLElement {
  const { collection, key, version, state } = shape;
  const bad = state !== ShapeState.READY;
  return h('a', { class: 'card', href: linkTo(address, 'shape', [key]) },
    pictureOf({ collection, key, version }, signal),
    keyLine(key),
    h('span', { class: 'card-note' }, noteOf(shape)),
    bad && h('span', { class: `badge state-${stateName(state)}`, title: shape.failure?.message }, stateName(state)));
}

/** Of keys that are paths the end says most. */
export function shortKey(key: string): string {
  return key.split('/').filter((part) => part !== '').pop() ?? key;
}

function keyLine(key: string): HTMLElement {
  return h('span', { class: 'card-key', title: key }, shortKey(key));
}

/** What tells it from others at a glance. */
function noteOf(shape: Shape): string {
  const folder = shape.key.slice(0, -shortKey(shape.key).length).replace(/\/$/, '');
  const [first] = [shape.metadata['label'], folder, ...givenMetadata(shape).map(([, value]) => value)].filter(Boolean);
  return first ?? `${count(shape.pointCount)} points`;
}

export function hitCard(hit: Hit, rank: number, href: string, signal: AbortSignal): HTMLElement {
  const shape = hit.shape!;
  const { collection, key, version } = shape;
  return h('a', { class: 'card hit', href },
    pictureOf({ collection, key, version }, signal),
    h('span', { class: 'rank' }, rank),
    keyLine(key),
    h('span', { class: 'card-note' }, noteOf(shape)),
    scoreLine(hit.score),
    verdictLine(hit.verdict, hit.verdictReliability),
    hit.explanation && smallReasons(hit.explanation.terms));
}

export function scoreLine(value: number): HTMLElement {
  const bar = h('span', { class: 'score-bar', 'aria-hidden': 'true' }, h('span', {}));
  (bar.firstChild as HTMLElement).style.width = `${100 * value}%`;
  return h('span', { class: 'score' }, h('span', { class: 'score-value' }, score(value)), bar);
}

export function verdictLine(verdict: Verdict, reliability: number): HTMLElement {
  if (verdict === Verdict.UNSPECIFIED) return h('span', { class: 'verdict none' }, 'not verified');
  return h('span', { class: `verdict ${verdictClass(verdict)}` },
    verdictName(verdict),
    h('span', { class: 'reliability' }, ` right in ${percent(reliability)} of such cases`));
}
