// SPDX-License-Identifier: Apache-2.0
// What is like a stored shape: hits with score, verdict and reasons.
import type { Address } from '../address';
import { goTo, linkTo, withOptions } from '../address';
import { call } from '../api/connect';
import type { Child } from '../dom';
import { h } from '../dom';
import { count, counted, seconds } from '../text';
import { hitCard } from '../parts/card';
import { choicesOf, kSearchOptions, switches } from '../parts/options';
import { pictureOf } from '../parts/picture';
import { storedShape } from '../parts/points';
import { empty, fillWhenLoaded } from '../parts/status';
import type { View } from '../view';
import type { SearchResponse } from '../../gen/shapedb/v1/search_service_pb';
import { SearchService } from '../../gen/shapedb/v1/search_service_pb';

const kHits = 24;

/** SearchOptions as the address has them. */
export function searchOptionsOf(address: Address) {
  const { partial, forbidReflection, keepScale, freeScale, verify } = choicesOf(address);
  return {
    collection: address.collection,
    k: Math.min(Math.max(Number(address.options['k']) || kHits, 1), 200),
    filter: address.options['filter'] ?? '',
    partial,
    forbidReflection,
    keepScale,
    freeScale,
    ...(verify === undefined ? {} : { verify }),
  };
}

export function likeView(address: Address, signal: AbortSignal): View {
  const key = address.keys[0] ?? '';
  const query = h('div', { class: 'query-picture' });
  const results = h('div', { class: 'results' });
  const element = h('div', { class: 'content' },
    h('div', { class: 'query' }, query,
      h('div', {}, h('h1', {}, 'Like ', h('a', { href: linkTo(address, 'shape', [key]) }, key)),
        switches(address, ['partial', 'mirror', 'size', 'verify'], signal), filterField(address))),
    results);
  void storedShape(address.collection, key, signal)
    .then(({ version }) => query.replaceChildren(pictureOf({ collection: address.collection, key, version }, signal)))
    .catch(() => undefined);  // the search tells that there is no such shape
  void fillWhenLoaded(results, 'Searching: bounds, scores, then the best laid on the query', signal, async () => {
    const response = await call(SearchService.method.searchByKey, { key, options: searchOptionsOf(address) }, { signal });
    return hits(response, address, signal, (hit) => linkTo(address, 'compare', [key, hit], kSearchOptions));
  });
  return { title: `Like ${key}`, element };
}

/** `hrefOf`: where a hit with this key is laid on the query. */
export function hits(
  response: SearchResponse, address: Address, signal: AbortSignal, hrefOf: (key: string) => string,
): Child[] {
  if (response.hits.length === 0) {
    return [empty('Nothing to compare with', response.filtered === 0n && response.candidates > 0n
      ? 'No shape passes the filter.' : 'The collection has no other shape that is ready.')];
  }
  return [
    h('p', { class: 'faint' }, summary(response, address.options['filter'] ?? '')),
    response.notExact && h('p', { class: 'note' }, 'Others might fit as well: more candidates could be laid on the query.'),
    h('div', { class: 'wall hits', role: 'list', 'aria-label': 'Hits, best first' }, ...response.hits.map((hit, i) =>
      h('div', { role: 'listitem' }, hitCard(hit, i + 1, hrefOf(hit.shape!.key), signal)))),
    moreHits(response, address),
  ];
}

function summary(response: SearchResponse, filter: string): string {
  const filtered = filter !== '' ? `, ${count(response.filtered)} pass the filter` : '';
  const pending = response.pending > 0n ? `; ${counted(response.pending, 'shape')} still waiting` : '';
  const segmented = response.report === undefined ? '' : `Segmented in ${seconds(response.secondsSegment)}; `;
  return `${segmented}${counted(response.candidates, 'shape')} searched${filtered}, ${count(response.scored)} scored in full, ` +
    `${count(response.candidatesVerified)} laid on the query, in ${seconds(response.secondsSearch)}${pending}`;
}

function moreHits(response: SearchResponse, address: Address): HTMLElement | null {
  const k = searchOptionsOf(address).k;
  if (response.hits.length < k || k >= 200) return null;
  return h('p', {}, h('button', {
    type: 'button', onclick: () => goTo(withOptions(address, { k: String(Math.min(2 * k, 200)) }), true),
  }, 'More hits'));
}

/** Only shapes that pass. */
export function filterField(address: Address): HTMLElement {
  const field = h('input', {
    type: 'text', id: 'filter', value: address.options['filter'] ?? '', placeholder: 'only shapes with, e.g. label=cup',
    'aria-label': 'Only shapes with this metadata', autocomplete: 'off', spellcheck: 'false',
  });
  return h('form', {
    class: 'inline-form',
    onsubmit: (event) => {
      event.preventDefault();
      goTo(withOptions(address, { filter: field.value.trim() }), true);
    },
  }, field, h('button', { type: 'submit' }, 'Filter'));
}
