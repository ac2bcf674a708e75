// SPDX-License-Identifier: Apache-2.0
// Two stored shapes, one laid on the other. A hit of a search by key is opened here.
import type { Address } from '../address';
import { formatAddress, goTo, linkTo } from '../address';
import { call } from '../api/connect';
import { fill, h } from '../dom';
import { choicesOf, kSearchOptions, switches } from '../parts/options';
import { fillOverlay } from '../parts/overlay';
import { kPointsAtFirst, storedCloud } from '../parts/points';
import { empty, failed, fillWhenLoaded, loading } from '../parts/status';
import { motionOf, why } from '../parts/why';
import type { View } from '../view';
import type { CompareResponse } from '../../gen/shapedb/v1/search_service_pb';
import { SearchService } from '../../gen/shapedb/v1/search_service_pb';

export function compareView(address: Address, signal: AbortSignal): View {
  const [query = '', other = ''] = address.keys;
  if (query === '' || other === '') return choosePair(address, query);
  const picture = h('div', { class: 'overlay' });
  const reasons = h('div', { class: 'panel' });
  const element = h('div', { class: 'with-panel' },
    h('div', { class: 'content' },
      h('h1', {}, h('a', { href: linkTo(address, 'shape', [other]) }, other), ' on ',
        h('a', { href: linkTo(address, 'shape', [query]) }, query)),
      picture),
    h('div', { class: 'side-panel' },
      h('p', {}, h('a', { class: 'button', href: linkTo(address, 'like', [query], kSearchOptions) }, `All hits of ${query}`),
        h('a', {
          class: 'button', href: formatAddress({ ...address, keys: [other, query] }),
        }, 'Swap')),
      switches(address, ['partial', 'mirror', 'size'], signal), reasons));
  fill(picture, loading('The points of both are being fetched and segmented'));
  void fillWhenLoaded(reasons, 'The two are being laid on each other', signal, async () => {
    const answer = await compare(address, query, other, signal);
    void draw(picture, address, answer, signal);
    return why(answer);
  }).then(() => {
    if (!signal.aborted && reasons.querySelector('.error') !== null) fill(picture);
  });
  return { title: `${other} on ${query}`, element };
}

function compare(address: Address, query: string, other: string, signal: AbortSignal): Promise<CompareResponse> {
  const { collection } = address;
  const { partial, forbidReflection, keepScale, freeScale } = choicesOf(address);
  return call(SearchService.method.compare, {
    query: { collection, key: query }, other: { collection, key: other }, partial, forbidReflection, keepScale, freeScale,
  }, { signal });
}

async function draw(place: HTMLElement, address: Address, answer: CompareResponse, signal: AbortSignal): Promise<void> {
  const [queryName = '', hitName = ''] = address.keys;
  try {
    const [query, hit] = await Promise.all([queryName, hitName].map((key) =>
      storedCloud(address.collection, key, kPointsAtFirst, signal)));
    if (signal.aborted) return;
    fillOverlay(place, {
      queryName, hitName, query: query!, hit: hit!, motion: motionOf(answer), explanation: answer.explanation,
    }, signal);
  } catch (error) {
    if (!signal.aborted) fill(place, failed(error, () => void draw(place, address, answer, signal)));
  }
}

/** Asks for the keys of the two. */
function choosePair(address: Address, first: string): View {
  const field = (id: string, value: string) => h('input', { id, type: 'text', value, required: true, autocomplete: 'off' });
  const query = field('first', first);
  const other = field('second', '');
  const element = h('div', { class: 'content narrow' },
    h('h1', {}, 'Compare two shapes'),
    h('form', {
      class: 'stacked',
      onsubmit: (event) => {
        event.preventDefault();
        goTo({ ...address, keys: [query.value, other.value] });
      },
    }, h('label', { for: 'first' }, 'Key of the shape that stays in its place'), query,
      h('label', { for: 'second' }, 'Key of the shape that is laid on it'), other,
      h('button', { type: 'submit', class: 'primary' }, 'Compare')),
    empty('Or by looking', 'Open a shape, find shapes like it, and open one of the hits.'));
  return { title: 'Compare', element };
}
