// SPDX-License-Identifier: Apache-2.0
// A collection: a wall of pictures, with what to filter it by at the left.
import type { Address } from '../address';
import { goTo, withOptions } from '../address';
import { call } from '../api/connect';
import { isCancelled } from '../api/failure';
import { append, fill, h } from '../dom';
import { counted, stateName } from '../text';
import { shapeCard } from '../parts/card';
import { fillFacets } from '../parts/facets';
import { empty, failed, loading } from '../parts/status';
import type { View } from '../view';
import { ShapeOrder, ShapeService } from '../../gen/shapedb/v1/shape_service_pb';
import { ShapeState } from '../../gen/shapedb/v1/types_pb';

const kPageSize = 60;

const kOrders: Record<string, { name: string; order: ShapeOrder; descending: boolean }> = {
  '': { name: 'oldest first', order: ShapeOrder.ID, descending: false },
  newest: { name: 'newest first', order: ShapeOrder.ID, descending: true },
  key: { name: 'by key', order: ShapeOrder.KEY, descending: false },
  changed: { name: 'last changed first', order: ShapeOrder.UPDATED, descending: true },
};
const kStates = [ShapeState.READY, ShapeState.PENDING, ShapeState.FAILED];

/** What of the collection is listed, as ListShapes and CountShapes take it. */
function selectionOf(address: Address) {
  const { filter = '', state = '', prefix = '' } = address.options;
  return {
    collection: address.collection,
    filter,
    state: kStates.find((one) => stateName(one) === state) ?? ShapeState.UNSPECIFIED,
    keyPrefix: prefix,
  };
}

export function shapesView(address: Address, signal: AbortSignal): View {
  const heading = h('h1', {}, address.collection);
  const total = h('span', { class: 'total', role: 'status' });
  const wall = h('div', { class: 'wall', role: 'list', 'aria-label': 'Shapes' });
  const end = h('div', { class: 'wall-end' });
  const facets = h('div', { class: 'facets' });
  const element = h('div', { class: 'with-side' },
    h('details', { class: 'side', open: matchMedia('(min-width: 760px)').matches },
      h('summary', {}, 'Filter'), filterForm(address), facets),
    h('div', { class: 'content' }, h('div', { class: 'title-row' }, heading, total, orders(address)), wall, end));
  void countInto(total, address, signal);
  void list(address, signal, wall, end, facets);
  return { title: address.collection, element };
}

async function countInto(place: HTMLElement, address: Address, signal: AbortSignal): Promise<void> {
  try {
    const { count: shapes } = await call(ShapeService.method.countShapes, selectionOf(address), { signal });
    fill(place, counted(shapes, 'shape'));
  } catch {
    // The listing tells what is wrong.
  }
}

/** Page after page, as the end of the wall comes into view. */
async function list(
  address: Address, signal: AbortSignal, wall: HTMLElement, end: HTMLElement, facets: HTMLElement,
): Promise<void> {
  const order = kOrders[address.options['order'] ?? ''] ?? kOrders['']!;
  let cursor = '';
  const next = async (): Promise<void> => {
    fill(end, loading('Shapes are being listed'));
    try {
      const page = await call(ShapeService.method.listShapes, {
        ...selectionOf(address), pageSize: kPageSize, cursor, order: order.order, descending: order.descending,
      }, { signal });
      append(wall, page.shapes.map((shape) => h('div', { role: 'listitem' }, shapeCard(shape, address, signal))));
      if (cursor === '') void fillFacets(facets, page.shapes, address, signal);
      cursor = page.nextCursor;
      fill(end, wall.childElementCount === 0 && nothing(address));
      if (cursor !== '') moreWhenSeen();
      else if (wall.childElementCount > kPageSize) fill(end, h('p', { class: 'faint' }, 'These are all.'));
    } catch (error) {
      if (!signal.aborted && !isCancelled(error)) fill(end, failed(error, () => void next()));
    }
  };
  const moreWhenSeen = () => {
    const button = h('button', { type: 'button', onclick: () => void next() }, 'Show more');
    fill(end, button);
    const sight = new IntersectionObserver((entries) => {
      if (!entries.some((entry) => entry.isIntersecting)) return;
      sight.disconnect();
      void next();
    }, { rootMargin: '400px' });
    sight.observe(button);
    signal.addEventListener('abort', () => sight.disconnect());
  };
  await next();
}

function nothing(address: Address): HTMLElement {
  const { filter = '', state = '', prefix = '' } = address.options;
  if (filter + state + prefix !== '') {
    return empty('No shape is like that',
      'Nothing in this collection passes the filter. ',
      h('button', {
        type: 'button', onclick: () => goTo(withOptions(address, { filter: '', state: '', prefix: '' })),
      }, 'Show all shapes'));
  }
  return empty('This collection is empty',
    'Drop a scan here to store it, or add many with ', h('code', {}, `shapedb add FOLDER --collection ${address.collection}`));
}

function filterForm(address: Address): HTMLElement {
  const filter = h('input', {
    type: 'text', id: 'filter', value: address.options['filter'] ?? '', placeholder: 'label=cup, year>=1990',
    autocomplete: 'off', spellcheck: 'false', maxlength: 16_384,
  });
  const prefix = h('input', {
    type: 'text', id: 'prefix', value: address.options['prefix'] ?? '', placeholder: 'all keys', autocomplete: 'off',
    spellcheck: 'false',
  });
  const state = h('select', { id: 'state', onchange: () => apply() },
    h('option', { value: '' }, 'any state'),
    ...kStates.map((one) => h('option', {
      value: stateName(one), selected: address.options['state'] === stateName(one),
    }, stateName(one))));
  const apply = () =>
    goTo(withOptions(address, { filter: filter.value.trim(), prefix: prefix.value, state: state.value }));
  const submit = (event: Event) => {
    event.preventDefault();
    apply();
  };
  return h('form', { class: 'filter-form', onsubmit: submit },
    h('label', { for: 'prefix' }, 'Key begins with'), prefix,
    h('label', { for: 'filter' }, 'Metadata'), filter,
    h('label', { for: 'state' }, 'State'), state,
    h('button', { type: 'submit' }, 'Apply'));
}

function orders(address: Address): HTMLElement {
  const choice = h('select', {
    id: 'order', 'aria-label': 'Order', onchange: () => goTo(withOptions(address, { order: choice.value })),
  }, ...Object.entries(kOrders).map(([value, { name }]) =>
    h('option', { value, selected: (address.options['order'] ?? '') === value }, name)));
  return choice;
}
