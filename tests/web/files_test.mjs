// SPDX-License-Identifier: Apache-2.0
// The page's file readers: the files that all readers are held to (tests/support/file_cases/), and what the page makes of
// what is in them.
import assert from 'node:assert/strict';
import { readFileSync } from 'node:fs';
import { after, before, test } from 'node:test';
import zlib from 'node:zlib';

import { bundled } from './bundle.mjs';

const { shapes, cases } = JSON.parse(readFileSync(new URL('../support/file_cases/cases.json', import.meta.url)));
let page, remove;

before(async () => ({ page, remove } = await bundled(['files/decode', 'files/ending', 'files/gunzip', 'scan_session'])));
after(() => remove());

/** In a buffer of its own, as a file has it. */
const bytesOf = ({ text, base64 }) => Uint8Array.from(text === undefined ? Buffer.from(base64, 'base64') : Buffer.from(text)).buffer;
const decode = (name, text) => page.decode(name, bytesOf({ text }));
const lines = (rows) => rows.map((row) => row.join(' ')).join('\n');

function refusal(read) {
  try {
    read();
  } catch (error) {
    return error;
  }
  return undefined;
}

test('files are read or refused as by all readers', () => {
  const wrong = [];
  for (const one of cases) {
    try {
      if (one.reads === undefined) checkRefused(one);
      else checkRead(one);
    } catch (error) {
      wrong.push(`${one.name}: ${error.message}`);
    }
  }
  assert.deepEqual(wrong, []);
});

function checkRead(one) {
  const content = page.readContent(one.file, bytesOf(one));
  const shape = shapes[one.reads];
  assert.deepEqual([...content.vertices], shape.vertices.flat());
  assert.deepEqual([...content.triangles], shape.triangles.flat());
  assert.equal(content.skipped, one.skipped ?? 0);
  assert.deepEqual(content.ignored, one.ignored === undefined ? [] : [one.ignored]);
}

function checkRefused(one) {
  const error = refusal(() => page.readContent(one.file, bytesOf(one)));
  assert.ok(error !== undefined, 'was read');
  assert.ok(error instanceof page.FileFault, error.stack);
  assert.notEqual(error.reason, 'internal', error.message);
  assert.equal(error.reason, one.refused, error.message);
  for (const part of [`${one.file}: `, ...one.says]) assert.ok(error.message.includes(part), `'${error.message}' lacks '${part}'`);
}

test('files that are cut short or damaged anywhere are read or refused in words', () => {
  let state = 7;
  const random = (below) => (state = (state * 48271) % 2147483647) % below;
  const sane = (one, bytes, what) => {
    const error = refusal(() => page.readContent(one.file, bytes.slice().buffer));
    if (error === undefined) return;
    assert.ok(error instanceof page.FileFault, `${one.name}, ${what}: ${error.stack}`);
    assert.ok(page.kReasons.includes(error.reason), `${one.name}, ${what}: ${error.reason}, ${error.message}`);
    assert.match(error.message, /^[ -~]+$/, one.name);
  };
  const plain = cases.filter(({ name }) => / (plain|packed)/.test(name) || /^(ply: a grid|pcd: padding|off: CNOFF on)/.test(name));
  assert.ok(plain.length > 20);
  for (const one of plain) {
    const bytes = new Uint8Array(bytesOf(one));
    for (let end = 0; end < bytes.length; ++end) sane(one, bytes.subarray(0, end), `cut at ${end}`);
    for (let round = 0; round < 200; ++round) {
      const changed = bytes.slice();
      for (let i = random(4); i >= 0; --i) changed[random(changed.length)] = random(2) ? random(256) : 48 + random(10);
      sane(one, changed, `damage ${round}`);
    }
  }
});

const kCorners = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]];
const kFaces = [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]];

test('surfaces are sampled, always alike', () => {
  const meshes = cases.filter(({ name, reads }) => ['cube', 'surface'].includes(reads) || / plain$/.test(name));
  assert.ok(meshes.length > 50);
  for (const one of meshes) {
    const scan = page.decode(one.file, bytesOf(one));
    const faces = shapes[one.reads].triangles;
    assert.equal(scan.sampled, faces.length > 0, one.name);
    if (faces.length > 0) assert.equal(scan.positions.length, 60_000, one.name);
  }
  const text = `OFF # a tetrahedron\n4 4 6\n${lines(kCorners)}\n${lines(kFaces.map((face) => [3, ...face]))}\n`;
  const { positions } = decode('a.off', text);
  for (let i = 0; i < positions.length; i += 3) {
    const [x, y, z] = positions.subarray(i, i + 3);
    assert.ok(Math.abs(Math.min(x, y, z, 1 - x - y - z)) < 1e-5, `${x} ${y} ${z}`);
  }
  assert.deepEqual(decode('a.off', text).positions, positions);
});

test('vertices are kept where they are what was measured', () => {
  const kSide = 150;
  const grid = Array.from({ length: kSide * kSide }, (_, i) => [i % kSide, Math.floor(i / kSide), Math.sin(i % kSide)]);
  const faces = [];
  for (let i = 0; i < kSide * (kSide - 1); ++i) if (i % kSide < kSide - 1) faces.push([3, i, i + 1, i + kSide], [3, i + 1, i + kSide + 1, i + kSide]);
  const dense = decode('dense.off', `OFF ${grid.length} ${faces.length} 0\n${lines(grid)}\n${lines(faces)}\n`);
  assert.deepEqual([dense.sampled, dense.positions.length], [false, 3 * grid.length]);
  const loose = decode('loose.off', `OFF ${grid.length} 1 0\n${lines(grid)}\n3 0 1 ${kSide}\n`);
  assert.deepEqual([loose.sampled, loose.positions.length], [false, 3 * grid.length], 'a cloud with a face');
  const flat = decode('flat.off', `OFF 4 1 0\n${lines(kCorners)}\n4 0 1 0 1\n`);
  assert.equal(flat.sampled, false, 'a face without area');
});

test('what is no scan is told in words', () => {
  const told = (name, text) => refusal(() => decode(name, text))?.message ?? 'read';
  assert.match(told('a.xyz', '1 2 3\n'), /^a\.xyz: the file has 1 point; a scan has at least 4$/);
  assert.match(told('a.LAS', 'LASF'), /^a\.LAS: .*`shapedb query FILE`.*`shapedb add FILE`/);
  assert.match(told('a.e57', 'x'), /^a\.e57: .*'\.e57' are not read; the page reads .*"Other formats"/);
  assert.match(told('a', 'x'), /^a: the file has no ending/);
  assert.match(told('a.xyz', '1e39 0 0\n1 0 0\n0 1 0\n0 0 1\n'), /point 0 has a coordinate beyond single precision/);
  assert.match(told('a.xyz', '1e-42 0 0\n0 0 0\n0 1e-42 0\n0 0 1e-42\n'), /too small for single precision/);
  assert.equal(page.withoutEnding('my.scan.PLY.gz'), 'my.scan');
});

test('a scan far from 0, 0, 0 keeps its digits', () => {
  const far = [4_400_000, 5_400_000, 120];
  const points = kCorners.flatMap((corner) => [corner, corner.map((value) => value / 8192)]);
  const texts = points.map((point) => point.map((value, axis) => value + far[axis]));
  const near = decode('near.xyz', lines(points));
  assert.deepEqual(near.origin, [0, 0, 0]);
  assert.equal('origin' in page.pointsOf(near), false);

  for (const [name, text] of [['far.xyz', lines(texts)], ['far.obj', lines(texts.map((row) => ['v', ...row]))], ['far.off', `OFF\n8 0 0\n${lines(texts)}\n`]]) {
    const scan = decode(name, text);
    const { pointCount, origin } = page.pointsOf(scan);
    assert.equal(pointCount, 8n, name);
    assert.deepEqual([origin.x, origin.y, origin.z], scan.origin, name);
    scan.positions.forEach((value, i) => assert.equal(value + scan.origin[i % 3], texts.flat()[i], `${name}, number ${i}`));
  }
  const faces = decode('far.off', `OFF\n8 4 0\n${lines(texts)}\n${lines(kFaces.map((face) => [3, ...face.map((i) => 2 * i)]))}\n`);
  assert.equal(faces.sampled, true);
  const inside = faces.positions.every((value, i) => value + faces.origin[i % 3] >= far[i % 3] - 1e-7 && value + faces.origin[i % 3] <= far[i % 3] + 1 + 1e-7);
  assert.ok(inside, 'samples of a surface far away lie in its box');
});

test('a few outliers hide no scan that lies far away', () => {
  const grid = (base) => Array.from({ length: 500 }, (_, i) => [i % 10, Math.floor(i / 10) % 10, Math.floor(i / 100)].map(
    (value, axis) => base[axis] + value / 7));
  const far = [4_400_000, 5_400_000, 120];
  const scan = decode('a.xyz', lines([[0, 0, 0], ...grid(far), [0, 0, 0]]));
  assert.ok(scan.origin.every((value, axis) => Math.abs(value - far[axis]) < 2), `${scan.origin}`);
  assert.deepEqual(decode('a.xyz', lines([[1e7, 0, 0], ...grid([0, 0, 0])])).origin, [0, 0, 0], 'the scan is here');
  const rounded = grid(far).map((point) => point.map(Math.fround));
  assert.throws(() => decode('a.xyz', lines([[0, 0, 0], ...rounded])), /in single precision.*without 1 point far from the others/);
});

test('gzip is unpacked as zlib packs it', () => {
  const { gzipSync, deflateRawSync, constants } = zlib;
  let state = 3;
  const random = (below) => (state = (state * 48271) % 2147483647) % below;
  for (const size of [0, 1, 2, 300, 70_000, 400_000]) {
    for (const kind of [() => random(256), () => 48 + random(10), () => 7]) {
      const data = Uint8Array.from({ length: size }, kind);
      for (const level of [0, 1, 6, 9]) {
        for (const strategy of [constants.Z_DEFAULT_STRATEGY, constants.Z_FIXED, constants.Z_HUFFMAN_ONLY]) {
          assert.deepEqual(Buffer.compare(page.gunzip(gzipSync(data, { level, strategy })), data), 0, `${size} bytes, level ${level}`);
        }
      }
    }
  }
  // With a name, a comment, an extra field and a checksum of the header.
  const data = Buffer.from('1 2 3\n');
  const head = Buffer.from([0x1f, 0x8b, 8, 2 + 4 + 8 + 16, 0, 0, 0, 0, 0, 3, 2, 0, 7, 7, ...Buffer.from('name\0comment\0'), 0, 0]);
  const tail = Buffer.alloc(8);
  tail.writeUInt32LE(page.crc32(data), 0);
  tail.writeUInt32LE(data.length, 4);
  assert.equal(Buffer.from(page.gunzip(Buffer.concat([head, deflateRawSync(data), tail]))).toString(), '1 2 3\n');
  const bomb = gzipSync(Buffer.alloc(80 << 20));
  assert.match(refusal(() => page.gunzip(bomb)).message, /more than 200 times as large/);
});
