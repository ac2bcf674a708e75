// SPDX-License-Identifier: Apache-2.0
// How alike the shapes of a collection are, each with each: near-duplicates and families as a matrix.
import type { Address } from '../address';
import { goTo, linkTo, withOptions } from '../address';
import { call } from '../api/connect';
import { groupedOrder } from '../cloud/grouping';
import { likenessColour } from '../cloud/palette';
import { fill, h } from '../dom';
import { count, counted, likeness, score } from '../text';
import { equalTerm } from '../filter';
import { keyLines } from '../parts/card';
import { pictureOf } from '../parts/picture';
import { empty, fillWhenLoaded } from '../parts/status';
import { filterField } from './like';
import type { View } from '../view';
import { SearchService } from '../../gen/shapedb/v1/search_service_pb';
import { ShapeOrder, ShapeService } from '../../gen/shapedb/v1/shape_service_pb';
import type { Shape } from '../../gen/shapedb/v1/types_pb';
import { ShapeState } from '../../gen/shapedb/v1/types_pb';

/** Of so many the matrix is still there in a few seconds, with two pixels or more for each. */
const kMostShapes = 300;
const kQueriesOfACall = 50;
const kMostFilterBytes = 16_000;
const kMostPairs = 24;
/** From this score on two shapes are near-duplicates (docs/verify.md: 93 % of such hits are the same object). */
const kDuplicate = 0.9;

export function familiesView(address: Address, signal: AbortSignal): View {
  const place = h('div', {});
  const element = h('div', { class: 'content' }, h('h1', {}, 'Families and near-duplicates'),
    h('p', { class: 'faint' }, 'Each shape against each other, by their signatures; like shapes stand together.'),
    filterField(address), place);
  void fillWhenLoaded(place, 'Each is being compared with each', signal, async () => {
    const filter = address.options['filter'] ?? '';
    const [page, all] = await Promise.all([
      call(ShapeService.method.listShapes, {
        collection: address.collection, filter, state: ShapeState.READY, pageSize: kMostShapes, order: ShapeOrder.ID,
      }, { signal }),
      call(ShapeService.method.countShapes, { collection: address.collection, filter, state: ShapeState.READY }, { signal }),
    ]);
    if (page.shapes.length < 2) return [empty('There is nothing to compare', 'It takes two shapes that are ready.')];
    const { shapes, filter: among } = chosen(page.shapes, filter, Number(all.count));
    const scores = await scoresOf(address, shapes, among, signal);
    const order = groupedOrder(scores);
    return [
      shapes.length < Number(all.count) && h('p', { class: 'note' },
        `These are the first ${count(shapes.length)} of ${count(all.count)} shapes. A filter chooses others; `,
        h('code', {}, `shapedb duplicates ${address.collection}`), ' finds the near-duplicates among all.'),
      duplicates(shapes, scores, address, signal), matrix(shapes, scores, order, address, signal),
    ];
  });
  return { title: 'Families', element };
}

/** The shapes to compare, of `total` that pass the filter, and a filter that only they pass: an answer has no room for others. */
function chosen(listed: Shape[], filter: string, total: number): { shapes: Shape[]; filter: string } {
  if (listed.length === total) return { shapes: listed, filter };
  const terms: string[] = [];
  let bytes = 0;
  for (const { key } of listed) {
    const term = equalTerm('@key', key);
    bytes += new TextEncoder().encode(term).length + 1;
    if (bytes > kMostFilterBytes) break;
    terms.push(term);
  }
  return { shapes: listed.slice(0, terms.length), filter: terms.join('|') };
}

/** scores[i][j], symmetric. `among`: a filter that the shapes pass, and few others. */
async function scoresOf(address: Address, shapes: Shape[], among: string, signal: AbortSignal): Promise<Float64Array[]> {
  const place = new Map(shapes.map((shape, i) => [shape.key, i]));
  const scores = shapes.map((_, i) => Float64Array.from(shapes, (_other, j) => (i === j ? 1 : 0)));
  for (let first = 0; first < shapes.length; first += kQueriesOfACall) {
    const answer = await call(SearchService.method.searchBatch, {
      options: { collection: address.collection, filter: among, k: shapes.length, noExplanation: true, verify: false },
      queries: shapes.slice(first, first + kQueriesOfACall).map(({ key }) => ({ by: { case: 'key' as const, value: key } })),
    }, { signal });
    answer.responses.forEach((response, query) => {
      const i = first + query;
      for (const hit of response.hits) {
        const j = place.get(hit.shape?.key ?? '');
        if (j !== undefined) scores[i]![j] = scores[j]![i] = Math.max(hit.score, scores[i]![j]!);
      }
    });
  }
  return scores;
}

function duplicates(shapes: Shape[], scores: Float64Array[], address: Address, signal: AbortSignal): HTMLElement {
  const pairs: { i: number; j: number; score: number }[] = [];
  scores.forEach((row, i) => {
    for (let j = i + 1; j < row.length; ++j) if (row[j]! >= kDuplicate) pairs.push({ i, j, score: row[j]! });
  });
  pairs.sort((a, b) => b.score - a.score);
  if (pairs.length === 0) return h('p', { class: 'note' }, `No two of them score ${kDuplicate} or more: no near-duplicates.`);
  const shown = pairs.slice(0, kMostPairs).map(({ i, j, score: value }) => ({
    a: shapes[i]!, b: shapes[j]!, value, verdict: h('span', { class: 'pair-verdict' }),
  }));
  void tellVerdicts(shown, signal);
  const picture = ({ collection, key, version }: Shape) => pictureOf({ collection, key, version }, signal);
  return h('section', {}, h('h2', {}, counted(pairs.length, 'pair'), ' of near-duplicates'),
    pairs.length > shown.length && h('p', { class: 'faint' }, `The best ${shown.length} of them:`),
    h('div', { class: 'pairs' }, ...shown.map(({ a, b, value, verdict }) =>
      h('a', { class: 'pair', href: linkTo(address, 'compare', [a.key, b.key]) },
        picture(a), picture(b),
        keyLines(a.key), keyLines(b.key),
        h('span', {}, score(value)), verdict))));
}

/** Lays the shapes of each pair on each other, which tells twins from mirrored ones. */
async function tellVerdicts(
  pairs: { a: Shape; b: Shape; verdict: HTMLElement }[], signal: AbortSignal,
): Promise<void> {
  for (const { a, b, verdict } of pairs) {
    try {
      const answer = await call(SearchService.method.compare, {
        query: { collection: a.collection, key: a.key }, other: { collection: b.collection, key: b.key },
      }, { signal });
      fill(verdict, likeness(answer.verdict, answer.fit, 'one is a piece of the other'));
    } catch {
      if (signal.aborted) return;  // otherwise one of them is gone, or has no surface points: nothing to say
    }
  }
}

/** One picture instead of thousands of elements; the pointer tells which two it is on. */
function matrix(
  shapes: Shape[], scores: Float64Array[], order: number[], address: Address, signal: AbortSignal,
): HTMLElement {
  const cell = Math.max(2, Math.floor(640 / shapes.length));
  const side = cell * shapes.length;
  const canvas = h('canvas', { width: side, height: side, class: 'matrix', role: 'img', 'aria-label': summaryOf(shapes, scores) });
  const context = canvas.getContext('2d')!;
  order.forEach((i, row) => order.forEach((j, column) => {
    context.fillStyle = `rgb(${likenessColour(scores[i]![j]!).map(Math.round).join(' ')})`;
    context.fillRect(column * cell, row * cell, cell - (cell > 8 ? 1 : 0), cell - (cell > 8 ? 1 : 0));
  }));
  const told = h('div', { class: 'matrix-told', role: 'status' }, 'Point at a cell to see which two shapes it is.');
  let toldOf = '';
  const at = (event: MouseEvent): [Shape, Shape, number] | undefined => {
    const place = (offset: number) => order[Math.floor((offset / canvas.clientWidth) * shapes.length)];
    const [i, j] = [place(event.offsetY), place(event.offsetX)];
    return i === undefined || j === undefined ? undefined : [shapes[i]!, shapes[j]!, scores[i]![j]!];
  };
  canvas.addEventListener('pointermove', (event) => {
    const found = at(event);
    if (found === undefined || toldOf === `${found[0].id} ${found[1].id}`) return;
    toldOf = `${found[0].id} ${found[1].id}`;
    fill(told, ...found.slice(0, 2).map((shape) => named(shape as Shape, signal)), h('p', {}, `score ${score(found[2])}`));
  });
  canvas.addEventListener('click', (event) => {
    const found = at(event);
    if (found !== undefined && found[0] !== found[1]) {
      goTo(withOptions({ ...address, page: 'compare', keys: [found[0].key, found[1].key] }, {}));
    }
  });
  return h('section', {}, h('h2', {}, 'Each with each'),
    h('p', { class: 'legend row' }, 'unlike ', h('span', { class: 'heat likeness', 'aria-hidden': 'true' }), ' alike'),
    h('div', { class: 'matrix-row' }, canvas, told));
}

function named({ collection, key, version }: Shape, signal: AbortSignal): HTMLElement {
  return h('div', {}, pictureOf({ collection, key, version }, signal), keyLines(key));
}

function summaryOf(shapes: Shape[], scores: Float64Array[]): string {
  const alike = scores.reduce((sum, row, i) => sum + row.filter((value, j) => j > i && value >= 0.5).length, 0);
  return `Matrix of ${shapes.length} shapes; ${counted(alike, 'pair')} score 0.5 or more`;
}
