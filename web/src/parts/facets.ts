// SPDX-License-Identifier: Apache-2.0
// Which values shapes have under which metadata key, to choose from: the filter of the address follows.
import type { Address } from '../address';
import { goTo, withOptions } from '../address';
import { call } from '../api/connect';
import { h, fill } from '../dom';
import { equalTerm, missingTerm, termsOf, toggled } from '../filter';
import { count, counted } from '../text';
import type { CountByValueResponse } from '../../gen/shapedb/v1/shape_service_pb';
import { ShapeService } from '../../gen/shapedb/v1/shape_service_pb';
import type { Shape } from '../../gen/shapedb/v1/types_pb';
import { givenMetadata } from './card';

const kMostKeys = 8;
const kMostValues = 12;

/** Fills `place` with the metadata keys of `shapes`, a part of the collection, and counts over all of it. */
export async function fillFacets(
  place: HTMLElement, shapes: Shape[], address: Address, signal: AbortSignal,
): Promise<void> {
  const keys = keysOf(shapes, address.options['filter'] ?? '');
  const counts = await Promise.all(keys.map((metadataKey) =>
    call(ShapeService.method.countByValue, {
      collection: address.collection, metadataKey, maxValues: kMostValues,
      filter: withoutKey(address.options['filter'] ?? '', metadataKey),
    }, { signal }).catch(() => undefined)));
  if (signal.aborted) return;
  const facets = keys.map((key, i) => counts[i] && facet(key, counts[i], address)).filter(Boolean);
  if (facets.length > 0) fill(place, ...facets);
  else fill(place, h('p', { class: 'faint' }, 'The shapes here have no metadata to filter by.'));
}

/** Most frequent first. */
function keysOf(shapes: Shape[], filter: string): string[] {
  const uses = new Map<string, number>();
  for (const term of termsOf(filter)) {
    const key = /^!?([^=!<>",\s]+)/.exec(term)?.[1];
    if (key !== undefined) uses.set(key, Infinity);
  }
  for (const shape of shapes) for (const [key] of givenMetadata(shape)) uses.set(key, (uses.get(key) ?? 0) + 1);
  return [...uses].sort(([a, m], [b, n]) => n - m || (a < b ? -1 : 1)).slice(0, kMostKeys).map(([key]) => key);
}

/** Other values of a chosen key stay in sight, to change over to. */
function withoutKey(filter: string, key: string): string {
  return termsOf(filter).filter((term) => !term.startsWith(`${key}=`) && term !== missingTerm(key)).join(', ');
}

function facet(key: string, counts: CountByValueResponse, address: Address): HTMLElement | null {
  const filter = address.options['filter'] ?? '';
  const chosen = termsOf(filter);
  const choice = (term: string, name: string, shapes: bigint) => h('li', {}, h('button', {
    type: 'button', class: 'facet-value', id: `facet-${term}`, 'aria-pressed': chosen.includes(term) ? 'true' : 'false',
    onclick: () => goTo(withOptions(address, { filter: toggled(filter, key, term) })),
  }, h('span', { class: 'facet-name' }, name), h('span', { class: 'facet-count' }, count(shapes))));
  const rows = counts.values.map(({ value, shapes }) => choice(equalTerm(key, value), value || '(empty)', shapes));
  if (counts.shapesWithout > 0n && rows.length > 0) rows.push(choice(missingTerm(key), 'without', counts.shapesWithout));
  if (rows.length === 0) return null;
  const others = counts.otherValues > 0n && h('p', { class: 'faint' }, `and ${counted(counts.otherValues, 'other value')}`);
  return h('section', { class: 'facet' }, h('h3', {}, key), h('ul', {}, ...rows), others);
}
