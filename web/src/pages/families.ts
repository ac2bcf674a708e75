// SPDX-License-Identifier: Apache-2.0
// How alike the shapes of a collection are, each with each: near-duplicates and families as a matrix.
import type { Address } from '../address';
import { goTo, linkTo, withOptions } from '../address';
import { call } from '../api/connect';
import { groupedOrder } from '../cloud/grouping';
import { likenessColour } from '../cloud/palette';
import { fill, h } from '../dom';
import { counted, score } from '../text';
import { shortKey } from '../parts/card';
import { pictureOf } from '../parts/picture';
import { empty, fillWhenLoaded } from '../parts/status';
import { filterField } from './like';
import type { View } from '../view';
import { SearchService } from '../../gen/shapedb/v1/search_service_pb';
import { ShapeOrder, ShapeService } from '../../gen/shapedb/v1/shape_service_pb';
import type { Shape } from '../../gen/shapedb/v1/types_pb';
import { ShapeState } from '../../gen/shapedb/v1/types_pb';

const kMostShapes = 80;
/** From this score on two shapes are near-duplicates (docs/verify.md: 93 % of such hits are the same object). */
const kDuplicate = 0.9;

export function familiesView(address: Address, signal: AbortSignal): View {
  const place = h('div', {});
  const element = h('div', { class: 'content' }, h('h1', {}, 'Families and near-duplicates'),
    h('p', { class: 'faint' }, `Each of the first ${kMostShapes} shapes that pass the filter against each other, ` +
      'by their signatures; like shapes stand together.'),
    filterField(address), place);
  void fillWhenLoaded(place, 'Each is being compared with each', signal, async () => {
    const { shapes } = await call(ShapeService.method.listShapes, {
      collection: address.collection, filter: address.options['filter'] ?? '', state: ShapeState.READY,
      pageSize: kMostShapes, order: ShapeOrder.ID,
    }, { signal });
    if (shapes.length < 2) return [empty('There is nothing to compare', 'It takes two shapes that are ready.')];
    const scores = await scoresOf(address, shapes, signal);
    const order = groupedOrder(scores);
    return [duplicates(shapes, scores, address, signal), matrix(shapes, scores, order, address, signal)];
  });
  return { title: 'Families', element };
}

/** scores[i][j], symmetric. */
async function scoresOf(address: Address, shapes: Shape[], signal: AbortSignal): Promise<Float64Array[]> {
  const place = new Map(shapes.map((shape, i) => [shape.key, i]));
  const answer = await call(SearchService.method.searchBatch, {
    options: {
      collection: address.collection, filter: address.options['filter'] ?? '', k: 1_000, noExplanation: true, verify: false,
    },
    queries: shapes.map(({ key }) => ({ by: { case: 'key' as const, value: key } })),
  }, { signal });
  const scores = shapes.map(() => new Float64Array(shapes.length));
  answer.responses.forEach((response, i) => {
    scores[i]![i] = 1;
    for (const hit of response.hits) {
      const j = place.get(hit.shape?.key ?? '');
      if (j !== undefined) scores[i]![j] = scores[j]![i] = Math.max(hit.score, scores[i]![j]!);
    }
  });
  return scores;
}

function duplicates(shapes: Shape[], scores: Float64Array[], address: Address, signal: AbortSignal): HTMLElement {
  const pairs: { i: number; j: number; score: number }[] = [];
  scores.forEach((row, i) => {
    for (let j = i + 1; j < row.length; ++j) if (row[j]! >= kDuplicate) pairs.push({ i, j, score: row[j]! });
  });
  pairs.sort((a, b) => b.score - a.score);
  if (pairs.length === 0) return h('p', { class: 'note' }, `No two of them score ${kDuplicate} or more: no near-duplicates.`);
  const picture = ({ collection, key, version }: Shape) => pictureOf({ collection, key, version }, signal);
  return h('section', {}, h('h2', {}, counted(pairs.length, 'pair'), ' of near-duplicates'),
    h('div', { class: 'pairs' }, ...pairs.slice(0, 24).map(({ i, j, score: value }) =>
      h('a', { class: 'pair', href: linkTo(address, 'compare', [shapes[i]!.key, shapes[j]!.key]) },
        picture(shapes[i]!), picture(shapes[j]!),
        h('span', { class: 'card-key', title: `${shapes[i]!.key} and ${shapes[j]!.key}` }, `${shortKey(shapes[i]!.key)}, ${shortKey(shapes[j]!.key)}`), h('span', {}, score(value))))));
}

/** One picture instead of thousands of elements; the pointer tells which two it is on. */
function matrix(
  shapes: Shape[], scores: Float64Array[], order: number[], address: Address, signal: AbortSignal,
): HTMLElement {
  const cell = Math.max(6, Math.floor(640 / shapes.length));
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
  return h('div', {}, pictureOf({ collection, key, version }, signal), h('span', { class: 'card-key', title: key }, shortKey(key)));
}

function summaryOf(shapes: Shape[], scores: Float64Array[]): string {
  const alike = scores.reduce((sum, row, i) => sum + row.filter((value, j) => j > i && value >= 0.5).length, 0);
  return `Matrix of ${shapes.length} shapes; ${counted(alike, 'pair')} score 0.5 or more`;
}
