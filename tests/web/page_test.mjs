// SPDX-License-Identifier: Apache-2.0
// The page as people use it, in a headless Chromium against a real server; what is drawn is judged by its pixels.
import assert from 'node:assert/strict';
import { readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { after, before, test } from 'node:test';

import {
  boxOf, complaints, createKey, openPage, pixelsOf, sample, scanAgain, settled, startBrowser, startServer, temporaryFolder, visit,
} from './harness.mjs';

const isBlue = ([r, g, b]) => b > 90 && b > r + 40 && b > g + 15;
const isOrange = ([r, g, b]) => r > 90 && r > b + 40 && r > g + 15;
/** Surveyed coordinates, in metres. */
const kFar = [4_400_000, 5_400_000, 120];
const kNasty = '<img src=x onerror=document.title="taken">';

let temporary, server, browser, scan;

/** An egg with a horn at one side: y times `sign`. */
function handed(sign) {
  const lines = [];
  for (let i = 0; i < 4000; ++i) {
    const z = 1 - (2 * i + 1) / 4000;
    const [r, turn] = [Math.sqrt(1 - z * z), 2.399963 * i];
    lines.push([r * Math.cos(turn), sign * 0.6 * r * Math.sin(turn), 0.4 * z].join(' '));
  }
  for (let i = 0; i < 2500; ++i) {
    const [t, turn] = [i / 2500, 2.399963 * i];
    lines.push([0.9 + 0.5 * t + 0.05 * Math.cos(turn), sign * (0.45 * t + 0.25 * t * t + 0.05 * Math.sin(turn)),
      0.9 * t * t + 0.05 * Math.cos(2 * turn)].join(' '));
  }
  return `${lines.join('\n')}\n`;
}

before(async () => {
  temporary = temporaryFolder();
  const folder = temporary.folder;
  sample(join(folder, 'scans'), '--families', 'dumbbell,human,mug', '--count', '3', '--points', '3000');
  scan = join(folder, 'again.xyz');
  scanAgain(join(folder, 'scans/human/human_01.ply'), scan);
  [server, browser] = await Promise.all([startServer(join(folder, 'data')), startBrowser()]);
  server.command('collection', 'create', 'parts');
  server.command('add', join(folder, 'scans'), '--base', join(folder, 'scans'), '--collection', 'parts', '--label-from-folder', '--wait');
  server.command('collection', 'create', 'twins');
  for (const [key, sign] of [['left', 1], ['right', -1]]) {
    writeFileSync(join(folder, `${key}.xyz`), handed(sign));
    server.command('add', join(folder, `${key}.xyz`), '--key', key, '--collection', 'twins', '--wait');
  }
  server.command('collection', 'create', 'sized', '--units', 'mm');
  server.command('add', join(folder, 'scans/mug/mug_01.ply'), '--key', 'small', '--collection', 'sized', '--wait');
  scanAgain(join(folder, 'scans/mug/mug_01.ply'), join(folder, 'large.xyz'));
  server.command('add', join(folder, 'large.xyz'), '--key', 'large', '--collection', 'sized', '--wait');
  server.command('add', scan, '--key', kNasty, '--meta', `note=${kNasty}`, '--collection', 'parts', '--wait');
});

after(async () => {
  await browser?.close();
  await server?.stop();
  temporary?.remove();
});

/** A test with a page of its own, on which nothing may go wrong. */
function pageTest(name, run, options) {
  test(name, async () => {
    const { page, faults, close } = await openPage(browser, server, options);
    try {
      await run(page);
      assert.deepEqual(faults, []);
    } finally {
      await close();
    }
  });
}

pageTest('a collection is a wall of pictures, and strangers\' words stay words', async (page) => {
  await visit(page, server, '#/');
  assert.equal(await page.locator('.card').count(), 10);
  assert.equal(await page.locator('.total').innerText(), '10 shapes');
  await page.locator('.picture canvas[data-drawn]').first().waitFor();
  const drawn = boxOf(await pixelsOf(page, '.picture'), isBlue);
  assert.ok(drawn.count > 500, `${drawn.count} pixels`);
  assert.ok(await page.getByText(kNasty.split('/').pop(), { exact: true }).count() > 0);
  assert.equal(await page.locator('main img').count(), 0);
  assert.ok(!(await page.title()).includes('taken'));
});

pageTest('keys in folders show their folders', async (page) => {
  await visit(page, server, '#/shapes/parts');
  const shown = await page.locator('.card-key').allInnerTexts();
  assert.ok(shown.some((text) => /^mug\/\s+mug_01$/.test(text)), shown.join(' | '));
  assert.equal(await page.locator('.card-key .folder').count(), 9);
});

pageTest('a view that there is not is told as such', async (page) => {
  await page.goto(`${server.url}/#/bogus/parts`);
  await page.getByRole('heading', { name: 'There is no view “bogus”' }).waitFor();
  assert.equal(await page.getByText('collection', { exact: false }).getByRole('alert').count(), 0);
  assert.match(await page.title(), /No such view/);
});

pageTest('mirrored twins are told', async (page) => {
  await visit(page, server, '#/compare/twins/left/right');
  assert.match(await page.locator('.verdict').innerText(), /^same object, mirrored/);
  await visit(page, server, '#/like/twins/left');
  assert.match(await page.locator('.hit .verdict').first().innerText(), /^same object, mirrored/);
  await visit(page, server, '#/families/twins');
  await page.locator('.pair-verdict', { hasText: 'same object, mirrored' }).waitFor();
});

pageTest('a search by key ranks, says what it found, and lays a hit on the query', async (page) => {
  await visit(page, server, '#/like/parts/human%2Fhuman_01');
  const first = page.locator('.hit').first();
  assert.match(await first.locator('.verdict').innerText(), /^same object/);
  assert.ok(Number(await first.locator('.score-value').innerText()) > 0.6);
  assert.equal(await first.locator('.reason').count(), 4);
  // In plain words, without a pointer over them.
  assert.match(await first.locator('.fit-words').innerText(), /^\d+ % of the query lies on the hit, \d+ % of what the query should show/);
  const seen = await first.locator('.reason .meaning').all();
  assert.equal(seen.length, 4);
  for (const one of seen) assert.ok(await one.isVisible() && (await one.innerText()).length > 20);
  await first.click();
  await page.locator('.overlay-controls').waitFor();
  await settled(page);
  assert.match(await page.locator('.panel .fit-words').innerText(), /lies on the hit/);
  const rows = page.locator('table.reasons tbody tr');
  assert.ok(await rows.count() >= 10);
  assert.equal(await rows.locator('.meaning').count(), await rows.count(), 'every reason is explained');
  const aligned = await pixelsOf(page, '.viewer');
  const [query, hit] = [boxOf(aligned, isBlue), boxOf(aligned, isOrange)];
  assert.ok(query.count > 1_000 && hit.count > 1_000, `${query.count} and ${hit.count} pixels`);
  for (const side of ['left', 'right', 'top', 'bottom']) {
    assert.ok(Math.abs(query[side] - hit[side]) < 0.1 * aligned.height, `${side}: ${query[side]} and ${hit[side]}`);
  }

  // Each alone covers as much as before, so both are seen where they lie on each other.
  for (const [name, is, other] of [['query', isOrange, isBlue], ['hit', isBlue, isOrange]]) {
    await page.locator('.overlay-controls').getByLabel(name, { exact: true }).uncheck();
    await settled(page);
    const alone = await pixelsOf(page, '.viewer');
    assert.ok(boxOf(alone, is).count > 1_000, `without the ${name}: ${boxOf(alone, is).count} pixels`);
    assert.ok(boxOf(alone, other).count < 100, `without the ${name}: ${boxOf(alone, other).count} pixels of it`);
    await page.locator('.overlay-controls').getByLabel(name, { exact: true }).check();
  }

  const slider = page.locator('.between');
  await slider.fill('0');
  await slider.dispatchEvent('change');
  await settled(page);
  const apart = await pixelsOf(page, '.viewer');
  assert.ok(boxOf(apart, isBlue).right < boxOf(apart, isOrange).left, 'side by side before they are aligned');

  await slider.fill('100');
  await page.getByLabel('distance').check();
  await page.getByText('of the query is nearer than').waitFor();
  await settled(page);
  const near = boxOf(await pixelsOf(page, '.viewer'), ([r, g, b]) => b > r && b > 90);
  assert.ok(near.count > 1_000, `${near.count} pixels are near: scans of one object touch`);
});

pageTest('whether sizes count is shown as it is', async (page) => {
  const box = page.getByLabel('Same size');
  const sizes = async (address) => {
    await visit(page, server, address);
    return [await box.isChecked(), await page.locator('.hit .score-value').first().innerText()];
  };
  const [ticked, score] = await sizes('#/like/sized/small');
  assert.equal(ticked, true, 'a collection with a unit');
  assert.deepEqual(await sizes('#/like/sized/small?size=1'), [true, score]);
  await visit(page, server, '#/like/sized/small');
  await box.uncheck();
  await page.waitForFunction(() => location.hash.endsWith('size=0'));
  const [free, freeScore] = await sizes('#/like/sized/small?size=0');
  assert.equal(free, false);
  assert.ok(Number(freeScore) > Number(score) + 0.1, `${freeScore} without sizes, ${score} with them`);
  await visit(page, server, '#/compare/sized/small/large');
  assert.equal(await box.isChecked(), true);
  await visit(page, server, '#/like/twins/left');
  assert.equal(await box.isChecked(), false, 'a collection without one');
});

pageTest('a dropped scan is shown in segments, searched with and stored', async (page) => {
  await visit(page, server, '#/shapes/parts');
  await page.setInputFiles('#file', scan);
  await page.locator('.hit').first().waitFor();
  await page.getByText('segment 2', { exact: false }).waitFor();
  await settled(page);
  assert.equal(await page.locator('.hit').first().locator('.score-value').innerText(), '1.000');
  const shown = await pixelsOf(page, '.viewer');
  const hues = [isBlue, isOrange, ([r, g, b]) => g > r + 25 && g > b + 15].map((is) => boxOf(shown, is).count);
  assert.ok(hues.filter((count) => count > 150).length >= 2, `pixels of the colours of segments: ${hues}`);

  await page.locator('.hit').nth(1).click();
  await page.locator('.overlay-controls').waitFor();
  await page.goBack();
  await page.locator('.hit').first().waitFor();

  await page.getByText('Store it in parts').click();
  await page.locator('#store-key').fill('stored here');
  await page.getByRole('button', { name: 'Store', exact: true }).click();
  await page.getByRole('link', { name: 'stored here is stored' }).click();
  await settled(page);
  assert.equal(await page.locator('h1').innerText(), 'stored here');
  server.command('delete', 'stored here', '--collection', 'parts');
});

pageTest('the stages of a scan are told while they run', async (page) => {
  await visit(page, server, '#/shapes/parts');
  // What is shown goes when it is done, so that each stage is noted as it comes.
  await page.evaluate(() => {
    window.told = new Set();
    new MutationObserver((changes) => {
      for (const { addedNodes } of changes) {
        for (const node of addedNodes) if (node.parentElement?.matches('.stages')) window.told.add(node.textContent);
      }
    }).observe(document.body, { childList: true, subtree: true });
  });
  await page.setInputFiles('#file', scan);
  await page.locator('.hit').first().waitFor();
  await page.getByText('Segmented in', { exact: false }).first().waitFor();
  const told = await page.evaluate(() => [...window.told]);
  for (const stage of ['Tetrahedra are laid between the points', 'Inside is told from outside', 'Parts are found',
    'Shapes are scored, the best are laid on it']) {
    assert.ok(told.includes(stage), `${stage}: ${told.join(' | ')}`);
  }
  assert.ok(!told.some((words) => words.startsWith('Stage: ')), told.join(' | '));
});

pageTest('a scan far from 0, 0, 0 keeps its digits', async (page) => {
  const far = join(temporary.folder, 'far.xyz');
  const moved = (line) => line.split(' ').map((value, axis) => (axis < 3 ? (Number(value) + kFar[axis]).toFixed(9) : value)).join(' ');
  writeFileSync(far, readFileSync(scan, 'utf8').trim().split('\n').map(moved).join('\n'));
  await visit(page, server, '#/shapes/parts');
  await page.setInputFiles('#file', far);
  await page.getByText('sent relative to about 4', { exact: false }).waitFor();
  await page.locator('.hit').first().waitFor();
  await page.getByText('segment 2', { exact: false }).waitFor();
  assert.ok(Number(await page.locator('.hit').first().locator('.score-value').innerText()) > 0.99);

  await page.getByText('Store it in parts').click();
  await page.locator('#store-key').fill('far away');
  await page.getByRole('button', { name: 'Store', exact: true }).click();
  await page.getByRole('link', { name: 'far away is stored' }).waitFor();
  const [x, y, z] = JSON.parse(server.command('get', 'far away', '--collection', 'parts', '--json')).origin;
  assert.ok(Math.hypot(x - kFar[0], y - kFar[1], z - kFar[2]) < 20, `${x} ${y} ${z}`);
  server.command('delete', 'far away', '--collection', 'parts');
});

pageTest('of a large shape some points come at first, and all on demand', async (page) => {
  sample(join(temporary.folder, 'large'), '--families', 'mug', '--count', '1', '--points', '70000');
  server.command('add', join(temporary.folder, 'large/mug/mug_01.ply'), '--key', 'large', '--collection', 'parts', '--wait');
  // Counted where the page reads, and told once it has read to the end: what is not read so far costs its connection.
  await page.addInitScript(() => {
    const plain = window.fetch;
    window.readToTheEnd = [];
    window.fetch = async (url, options) => {
      const response = await plain(url, options);
      if (!String(url).endsWith('/GetSegments')) return response;
      let bytes = 0;
      const counted = new TransformStream({
        transform: (piece, out) => {
          bytes += piece.byteLength;
          out.enqueue(piece);
        },
        flush: () => void window.readToTheEnd.push(bytes),
      });
      return new Response(response.body.pipeThrough(counted), { status: response.status, headers: response.headers });
    };
  });
  // 12 bytes of coordinates for each point, and its segment in one.
  const fetched = async (which) => {
    const bytes = await page.waitForFunction((i) => window.readToTheEnd[i], which);
    return await bytes.jsonValue() / 13;
  };
  await visit(page, server, '#/shape/parts/large');
  const few = await fetched(0);
  assert.ok(few > 55_000 && few < 68_000, `${few} points at first`);
  const button = page.getByRole('button', { name: 'Show all 70,000 points' });
  await button.click();
  const all = await fetched(1);
  assert.ok(all > 69_000, `${all} points on demand`);
  await button.waitFor({ state: 'detached' });
  server.command('delete', 'large', '--collection', 'parts');
});

pageTest('a file that is no scan is refused in words', async (page) => {
  const bad = join(temporary.folder, 'bad.off');
  writeFileSync(bad, 'OFF\n4 1 0\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 1 9\n');
  await visit(page, server, '#/shapes/parts');
  await page.setInputFiles('#file', bad);
  const alert = page.getByRole('alert');
  await alert.waitFor();
  assert.match(await alert.innerText(), /bad\.off: line 7: face 0 of 1 names vertex 9, but the file has 4 vertices/);
});

pageTest('facets filter, and the address is a link to what is seen', async (page) => {
  await visit(page, server, '#/shapes/parts');
  await page.locator('.facet-value', { hasText: 'mug' }).click();
  await settled(page);
  await page.getByText('3 shapes').waitFor();
  assert.match(page.url(), /filter=label%3Dmug/);
  await page.reload();
  await settled(page);
  assert.equal(await page.locator('.card').count(), 3);
  await page.locator('#filter').fill('label==');
  await page.getByRole('button', { name: 'Apply' }).click();
  await page.getByRole('alert').waitFor();
  assert.match(await page.getByRole('alert').innerText(), /column 7/);
  await page.locator('#filter').fill('label=nothing');
  await page.getByRole('button', { name: 'Apply' }).click();
  await page.getByText('No shape is like that').waitFor();
});

pageTest('the keyboard is enough', async (page) => {
  await visit(page, server, '#/shapes/parts');
  await page.keyboard.press('/');
  await page.keyboard.type('mug');
  await page.keyboard.press('Enter');
  await page.getByText('3 shapes').waitFor();
  await page.keyboard.press('Escape');
  await page.keyboard.press('ArrowDown');
  await page.keyboard.press('ArrowRight');
  await page.keyboard.press('Enter');
  await page.getByRole('heading', { name: 'mug/mug_02' }).waitFor();
  await page.keyboard.press('?');
  await page.getByRole('dialog').waitFor();
});

const kViews = ['#/shapes/parts', '#/like/parts/mug%2Fmug_01', '#/compare/parts/mug%2Fmug_01/mug%2Fmug_02',
  '#/shape/parts/mug%2Fmug_01', '#/families/parts', '#/admin/parts', '#/scan/parts', '#/compare/parts', '#/shape/parts/none'];
for (const colorScheme of ['light', 'dark']) {
  pageTest(`everybody can use it: ${colorScheme}`, async (page) => {
    for (const view of kViews) {
      await visit(page, server, view);
      assert.deepEqual(await complaints(page), [], view);
    }
  }, { colorScheme });
}

pageTest('it fits a phone', async (page) => {
  for (const view of kViews) {
    await visit(page, server, view);
    const [wide, seen] = await page.evaluate(() => [document.documentElement.scrollWidth, innerWidth]);
    assert.ok(wide <= seen, `${view} is ${wide} wide, ${seen} are seen`);
  }
}, { viewport: { width: 390, height: 800 } });

test('a server with keys asks for one, and keeps it for the tab alone', async () => {
  const locked = temporaryFolder();
  const secret = createKey(locked.folder, 'reader');
  const guarded = await startServer(locked.folder, '--security-keys', 'always');
  const { page, faults, close } = await openPage(browser, guarded);
  try {
    await page.goto(guarded.url);
    await page.locator('#api-key').fill(secret.slice(0, -1));
    await page.getByRole('button', { name: 'Use' }).click();
    await page.locator('#api-key').fill(secret);
    await page.getByRole('button', { name: 'Use' }).click();
    await page.getByText('This collection is empty').waitFor();
    assert.equal(await page.evaluate(() => JSON.stringify(localStorage) + document.cookie + location.href).then((kept) => kept.includes('shapedb_')), false);
    await guarded.stop();
    await page.reload().catch(() => undefined);
    assert.deepEqual(faults, []);
  } finally {
    await close();
    await guarded.stop();
    locked.remove();
  }
});

test('a server that has gone is told', async () => {
  const { folder, remove } = temporaryFolder();
  const short = await startServer(folder);
  const { page, close } = await openPage(browser, short);
  try {
    await visit(page, short, '#/');
    await short.stop();
    await page.getByRole('link', { name: 'Families' }).click();
    await page.getByText('The server does not answer').waitFor();
  } finally {
    await close();
    remove();
  }
});
