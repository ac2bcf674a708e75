// SPDX-License-Identifier: Apache-2.0
// The page's arithmetic without a browser.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { after, before, test } from 'node:test';

import { bundled } from './bundle.mjs';

let page, remove;

before(async () => ({ page, remove } = await bundled(
  ['address', 'filter', 'cloud/nearest', 'cloud/grouping', 'cloud/motion', 'cloud/cloud', 'api/envelope', 'text', 'parts/reasons'])));
after(() => remove());

test('distances are those of trying all', () => {
  let state = 1;
  const random = () => (state = (state * 16807) % 2147483647) / 2147483647 - 0.5;
  const cloud = (count) => Float32Array.from({ length: 3 * count }, random);
  const [from, to, most] = [cloud(300), cloud(400), 0.07];
  const found = page.distancesTo(from, to, most);
  for (let i = 0; i < 300; ++i) {
    let least = most;
    for (let j = 0; j < 400; ++j) {
      least = Math.min(least, Math.hypot(from[3 * i] - to[3 * j], from[3 * i + 1] - to[3 * j + 1], from[3 * i + 2] - to[3 * j + 2]));
    }
    assert.ok(Math.abs(found[i] - least) < 1e-6, `${found[i]}, not ${least}`);
  }
});

test('a motion carries the hit to the query', () => {
  // Mirrored at x, turned a quarter about z, twice as large, moved.
  const motion = { rotation: [0, -1, 0, -1, 0, 0, 0, 0, 1], scale: 2, translation: { x: 5, y: 6, z: 7 }, reflected: true };
  const [hit, query] = [{ centre: [1, 2, 3], size: 4 }, { centre: [2, 1, 0], size: 8 }];
  const placement = page.alignedPlacement(motion, hit, query);
  const matrix = page.between(page.besidePlacement(1), placement, 1);
  const x = [3, -1, 2];
  const moved = [0, 1, 2].map((row) => 2 * (motion.rotation[3 * row] * x[0] + motion.rotation[3 * row + 1] * x[1] + motion.rotation[3 * row + 2] * x[2]) + [5, 6, 7][row]);
  const m = matrix.elements;
  const inFrame = x.map((value, axis) => (value - hit.centre[axis]) / hit.size);
  const shown = [0, 1, 2].map((row) => m[row] * inFrame[0] + m[4 + row] * inFrame[1] + m[8 + row] * inFrame[2] + m[12 + row]);
  shown.forEach((value, axis) => assert.ok(Math.abs(value - (moved[axis] - query.centre[axis]) / query.size) < 1e-9));
});

test('like things stand together', () => {
  const family = [0, 1, 0, 1, 2, 0];
  const scores = family.map((a, i) => Float64Array.from(family, (b, j) => (i === j ? 1 : a === b ? 0.8 : 0.2)));
  const order = page.groupedOrder(scores).map((i) => family[i]);
  assert.equal(order.filter((one, i) => i > 0 && one !== order[i - 1]).length, 2, order.join());
});

test('filters keep their other terms', () => {
  assert.deepEqual(page.termsOf('a=1, b="x, \\"y", !c'), ['a=1', 'b="x, \\"y"', '!c']);
  assert.equal(page.equalTerm('k', 'a, "b"\\'), 'k="a, \\"b\\"\\\\"');
  assert.equal(page.toggled('a=1, b=2', 'a', 'a=3'), 'b=2, a=3');
  assert.equal(page.toggled('a=1, b=2', 'a', 'a=1'), 'b=2');
  assert.deepEqual(page.termsOf('a=1 | b=2, c'), ['a=1 | b=2', 'c']);
  assert.equal(page.equalTerm('k', 'a|b'), 'k="a|b"');
  assert.equal(page.toggled('a=1 | b=2, a=2', 'a', 'a=3'), 'a=1 | b=2, a=3', 'alternatives are kept');
  assert.equal(page.toggled('a="1|2"', 'a', 'a=3'), 'a=3', 'one value, in quotes');
  assert.equal(page.toggled('year>=1990', 'year', 'year=1995'), 'year>=1990, year=1995');
});

test('an address comes back as it was', () => {
  const address = { page: 'compare', collection: 'a.b-c', keys: ['x/y?&#%', 'ключ'], options: { filter: 'a=1, b>=2' } };
  assert.deepEqual(page.parseAddress(page.formatAddress(address)), address);
  assert.deepEqual(page.parseAddress('#/shapes/c/100%'), { page: 'shapes', collection: 'c', keys: ['100%'], options: {} });
  assert.deepEqual(page.parseAddress('#/nonsense/c'), { page: 'shapes', unknown: 'nonsense', collection: '', keys: [], options: {} });
});

test('a mirrored twin is told, unless left and right look alike', () => {
  const fit = (reflected, leftRightOpen) => ({ best: { motion: { reflected } }, leftRightOpen });
  const [same, unrelated] = [1, 5];  // Verdict
  assert.equal(page.likeness(same, fit(true, false)), 'same object, mirrored');
  assert.equal(page.likeness(same, fit(true, true)), 'same object');
  assert.equal(page.likeness(same, undefined), 'same object');
  assert.equal(page.likeness(unrelated, fit(true, false)), 'unrelated');
  assert.equal(page.fitsMirrored(undefined), undefined);
});

test('reasons say what docs/concepts.md says of them', () => {
  const text = readFileSync(new URL('../../docs/concepts.md', import.meta.url), 'utf8');
  const reasons = text.slice(text.indexOf('## Reasons'), text.indexOf('## Views'));
  const rows = [...reasons.matchAll(/^\| ([a-z ]+) \| ([^|]+) \|$/gm)].map(([, name, meaning]) => [name, meaning]).slice(1);
  assert.ok(rows.length >= 14);
  assert.deepEqual(page.kMeanings, Object.fromEntries(rows));
});

test('how two lie on each other is said in words', () => {
  assert.equal(page.fitWords({ explainedQuery: 0.33, explainedOther: 0.984 }),
    '33 % of the query lies on the hit, 98 % of what the query should show of it is there');
});

test('envelopes are found in any pieces', () => {
  const whole = [];
  for (const text of ['first', '', 'third']) for (const part of page.inEnvelope(new TextEncoder().encode(text))) whole.push(...part);
  for (const size of [1, 2, 7, 100]) {
    const reader = new page.EnvelopeReader();
    const found = [];
    for (let at = 0; at < whole.length; at += size) found.push(...reader.add(Uint8Array.from(whole.slice(at, at + size))));
    assert.deepEqual(found.map(({ message }) => new TextDecoder().decode(message)), ['first', '', 'third'], `pieces of ${size}`);
  }
});

test('frames of points with an origin are in the coordinates of the client', () => {
  assert.deepEqual(page.movedFrame({ centre: [1, 2, 3], size: 4 }, [10, 20, 30]), { centre: [11, 22, 33], size: 4 });
});
