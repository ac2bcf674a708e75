// SPDX-License-Identifier: Apache-2.0
// A shape on the wall, and a hit among others.
import type { Address } from '../address';
import { linkTo } from '../address';
import { h } from '../dom';
import { count, fitWords, likeness, percent, score, stateName, verdictClass } from '../text';
import type { Fit, Hit } from '../../gen/shapedb/v1/search_service_pb';
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
    keyLines(key),
    h('span', { class: 'card-note' }, noteOf(shape)),
    bad && h('span', { class: `badge state-${stateName(state)}`, title: shape.failure?.message }, stateName(state)));
}

/** A key: of one that is a path the folder, whose end says most, above the name. */
export function keyLines(key: string): HTMLElement {
  const at = key.replace(/\/+$/, '').lastIndexOf('/') + 1;
  return h('span', { class: 'card-key', title: key },
    // Set from right to left, so that the beginning is what has no room; inside it is the text it is.
    at > 0 && h('span', { class: 'folder' }, h('bdi', { dir: 'ltr' }, key.slice(0, at))),
    h('span', { class: 'name' }, key.slice(at)));
}

/** What tells it from others at a glance. */
function noteOf(shape: Shape): string {
  const label = shape.metadata['label'] ?? '';
  // Often the folder has its name.
  const [first] = [shape.key.includes(`${label}/`) ? '' : label, ...givenMetadata(shape).filter(([name]) => name !== 'label').map(([, value]) => value)].filter(Boolean);
  return first ?? `${count(shape.pointCount)} points`;
}

export function hitCard(hit: Hit, rank: number, href: string, signal: AbortSignal): HTMLElement {
  const shape = hit.shape!;
  const { collection, key, version } = shape;
  return h('a', { class: 'card hit', href },
    pictureOf({ collection, key, version }, signal),
    h('span', { class: 'rank' }, rank),
    keyLines(key),
    h('span', { class: 'card-note' }, noteOf(shape)),
    scoreLine(hit.score),
    verdictLine(hit),
    hit.fit?.best && h('span', { class: 'fit-words' }, fitWords(hit.fit.best)),
    hit.explanation && smallReasons(hit.explanation.terms));
}

export function scoreLine(value: number): HTMLElement {
  const bar = h('span', { class: 'score-bar', 'aria-hidden': 'true' }, h('span', {}));
  (bar.firstChild as HTMLElement).style.width = `${100 * value}%`;
  return h('span', { class: 'score' }, h('span', { class: 'score-value' }, score(value)), bar);
}

/** `part`: what to say of a query that is a piece of the other. */
export function verdictLine(
  { verdict, verdictReliability, fit }: Pick<Hit, 'verdict' | 'verdictReliability'> & { fit?: Fit | undefined },
  part?: string,
): HTMLElement {
  if (verdict === Verdict.UNSPECIFIED) return h('span', { class: 'verdict none' }, 'not verified');
  return h('span', { class: `verdict ${verdictClass(verdict)}` },
    likeness(verdict, fit, part),
    h('span', { class: 'reliability' }, ` right in ${percent(verdictReliability)} of such cases`));
}
