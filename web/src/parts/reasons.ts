// SPDX-License-Identifier: Apache-2.0
// Why two shapes have their score, as bars: how alike they are in each respect.
import { h } from '../dom';
import { percent } from '../text';
import type { ScoreTerm } from '../../gen/shapedb/v1/search_service_pb';

const kSmall = 4;

/** What two shapes are alike in, as docs/concepts.md has it. */
export const kMeanings: Record<string, string> = {
  fit: 'how well their surfaces lie on each other',
  parts: 'their segments: how many, how large, and where they are',
  'contained parts': 'the segments of a query that is a part: whether the hit has them, as large and in the same places',
  'surface distances': 'overall proportions: compact, flat or long',
  chords: 'being solid or hollow, compact or branched',
  'thickness by radius': 'how thick they are near the middle and far from it',
  'thickness by centrality': 'how thick they are near the middle and far from it, along bent limbs too',
  'thickness change': 'having thick and thin parts, or one thickness all over',
  bending: 'being straight or curled',
  spread: 'how much of them is rod, sheet or body',
  'surface harmonics': 'where the surface is, seen from the middle: how many limbs, and in which arrangement',
  'interior harmonics': 'where what is inside lies, seen from the middle',
  footprint: 'their outline, seen from above as they lie',
  'footprint distances': 'the proportions of their outline, seen from above as they lie',
};

/** Nothing for a reason of a server that is newer than the page in a tab. */
function meaning(term: ScoreTerm): HTMLElement | undefined {
  const words = kMeanings[term.name];
  return words === undefined ? undefined : h('span', { class: 'meaning' }, words);
}

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
      h('span', { class: 'unseen' }, `${percent(likeness(term))} alike`), meaning(term))));
}

/** All of them, heaviest first, with what they count. */
export function allReasons(terms: ScoreTerm[]): HTMLElement {
  const rows = [...terms].sort((a, b) => b.weight - a.weight).map((term) =>
    h('tr', {},
      h('th', { scope: 'row' }, term.name, meaning(term)),
      h('td', { class: 'wide' }, bar(term)),
      h('td', {}, percent(likeness(term))),
      h('td', { class: 'faint' }, percent(term.weight))));
  return h('table', { class: 'reasons' },
    h('thead', {}, h('tr', {},
      h('th', { scope: 'col' }, 'in respect of'), h('td', {}), h('th', { scope: 'col' }, 'alike'),
      h('th', { scope: 'col' }, 'counts'))),
    h('tbody', {}, ...rows));
}
