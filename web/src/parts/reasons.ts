// SPDX-License-Identifier: Apache-2.0
// Why two shapes have their score, as bars: how alike they are in each respect.
import { h } from '../dom';
import { percent } from '../text';
import type { ScoreTerm } from '../../gen/shapedb/v1/search_service_pb';

const kSmall = 4;

/** 1: identical; 0: as far apart as unrelated shapes are, or farther. */
function likeness(term: ScoreTerm): number {
  return Math.min(Math.max(1 - term.distance, 0), 1);
}

function bar(term: ScoreTerm): HTMLElement {
  const inner = h('span', {});
  inner.style.width = `${100 * likeness(term)}%`;
  return h('span', { class: 'bar', 'aria-hidden': 'true' }, inner);
}

/** The respects that weigh most, for a card. */
export function smallReasons(terms: ScoreTerm[]): HTMLElement | null {
  if (terms.length === 0) return null;
  const heaviest = [...terms].sort((a, b) => b.weight - a.weight).slice(0, kSmall);
  return h('span', { class: 'reasons small' },
    ...heaviest.map((term) => h('span', { class: 'reason' }, h('span', { class: 'reason-name' }, term.name), bar(term),
      h('span', { class: 'unseen' }, `${percent(likeness(term))} alike`))));
}

/** All of them, heaviest first, with what they count. */
export function allReasons(terms: ScoreTerm[]): HTMLElement {
  const rows = [...terms].sort((a, b) => b.weight - a.weight).map((term) =>
    h('tr', {},
      h('th', { scope: 'row' }, term.name),
      h('td', { class: 'wide' }, bar(term)),
      h('td', {}, percent(likeness(term))),
      h('td', { class: 'faint' }, percent(term.weight))));
  return h('table', { class: 'reasons' },
    h('thead', {}, h('tr', {},
      h('th', { scope: 'col' }, 'in respect of'), h('td', {}), h('th', { scope: 'col' }, 'alike'),
      h('th', { scope: 'col' }, 'counts'))),
    h('tbody', {}, ...rows));
}
