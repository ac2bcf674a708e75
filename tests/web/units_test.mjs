// SPDX-License-Identifier: Apache-2.0
// The page's arithmetic and file readers without a browser.
import assert from 'node:assert/strict';
import { mkdtempSync, rmSync } from 'node:fs';
import { createRequire } from 'node:module';
import { join } from 'node:path';
import { fileURLToPath, pathToFileURL } from 'node:url';
import { after, before, test } from 'node:test';

const web = fileURLToPath(new URL('../../web', import.meta.url));
const { build } = createRequire(join(web, 'package.json'))('esbuild');

let folder, page;

before(async () => {
  folder = mkdtempSync(join(web, 'node_modules/.units-'));  // where imports of the bundle are found
  const parts = ['address', 'filter', 'files/decode', 'cloud/nearest', 'cloud/grouping', 'cloud/motion', 'cloud/cloud', 'api/envelope'];
  await build({
    stdin: { contents: parts.map((part) => `export * from './${part}';`).join('\n'), resolveDir: join(web, 'src'), loader: 'ts' },
    bundle: true, format: 'esm', platform: 'node', outfile: join(folder, 'page.mjs'), logLevel: 'error',
  });
  page = await import(pathToFileURL(join(folder, 'page.mjs')));
});
after(() => rmSync(folder, { recursive: true, force: true }));

const bytesOf = (text) => new TextEncoder().encode(text).buffer;
const decode = (name, text) => page.decode(name, bytesOf(text));

const kCorners = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]];
const kFaces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];
const lines = (rows) => rows.map((row) => row.join(' ')).join('\n');

test('points are read from every format', () => {
  const flat = kCorners.flat();
  const ply = `ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nend_header\n${lines(kCorners)}\n`;
  const pcd = `VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 4\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 4\nDATA ascii\n${lines(kCorners)}\n`;
  const texts = {
    'a.ply': ply, 'a.pcd': pcd, 'a.off': `OFF\n4 0 0\n${lines(kCorners)}\n`, 'a.xyz': lines(kCorners),
    'a.csv': `x,y,z,intensity\r\n${kCorners.map((row) => [...row, 7].join(',')).join('\r\n')}`,
    'A.PTS': `4\n${kCorners.map((row) => [...row, -5, 1, 2, 3].join(' ')).join('\n')}`,
    'a.obj': kCorners.map((row) => `v ${row.join(' ')}`).join('\n') + '\np 1 2 3 4\n',
  };
  for (const [name, text] of Object.entries(texts)) {
    const scan = decode(name, text);
    assert.deepEqual([...scan.positions], flat, name);
    assert.equal(scan.sampled, false, name);
  }
});

test('surfaces are sampled, always alike', () => {
  const off = `OFF # a tetrahedron\n4 4 6\n${lines(kCorners)}\n${lines(kFaces.map((face) => [3, ...face]))}\n`;
  const obj = `${kCorners.map((row) => `v ${row.join(' ')}`).join('\n')}\n${kFaces.map((face) => `f ${face.map((i) => i + 1).join(' ')}`).join('\n')}\n`;
  const stl = `solid t\n${kFaces.map((face) => `facet normal 0 0 0\nouter loop\n${face.map((i) => `vertex ${kCorners[i].join(' ')}`).join('\n')}\nendloop\nendfacet`).join('\n')}\nendsolid t\n`;
  const ply = `ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\nelement face 4\nproperty list uchar int vertex_indices\nend_header\n${lines(kCorners)}\n${lines(kFaces.map((face) => [3, ...face]))}\n`;
  for (const [name, text] of Object.entries({ 'a.off': off, 'a.obj': obj, 'a.stl': stl, 'a.ply': ply })) {
    const scan = decode(name, text);
    assert.equal(scan.sampled, true, name);
    assert.equal(scan.positions.length, 60_000, name);
    for (let i = 0; i < scan.positions.length; i += 3) {
      const [x, y, z] = scan.positions.subarray(i, i + 3);
      const onFace = Math.min(x, y, z, 1 - x - y - z);
      assert.ok(Math.abs(onFace) < 1e-5, `${name}: ${x} ${y} ${z}`);
    }
    assert.deepEqual(decode(name, text).positions, scan.positions, name);
  }
});

test('bad files are refused in words', () => {
  assert.throws(() => decode('a.xyz', '1 2 3\n4 5 x\n'), /a\.xyz .*line 2 does not begin with three numbers/);
  assert.throws(() => decode('a.xyz', '1 2 3\n'), /1 usable points/);
  assert.throws(() => decode('a.exe', ''), /this ending is not known/);
  assert.throws(() => decode('a.off', 'OFF\n9 0 0\n0 0 0\n'), /9 corners and 0 faces are announced/);
  assert.throws(() => decode('a.ply', 'no ply at all'), /a\.ply/);
  const some = decode('a.xyz', `nan 0 0\n${lines(kCorners)}\n`);
  assert.deepEqual([some.positions.length, some.skipped], [12, 1]);
});

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
  assert.deepEqual(page.parseAddress('#/nonsense/c/100%'), { page: 'shapes', collection: 'c', keys: ['100%'], options: {} });
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
