// SPDX-License-Identifier: Apache-2.0
// The file that `shapedb report` writes, in a headless Chromium without a server; what is drawn is judged by its pixels.
import assert from 'node:assert/strict';
import { join } from 'node:path';
import { after, before, test } from 'node:test';
import { pathToFileURL } from 'node:url';

import { boxOf, complaints, openPage, pixelsOf, sample, scanAgain, startBrowser, startServer, temporaryFolder } from './harness.mjs';

const isQuery = ([r, g, b]) => b > r + 40 && g > r + 15;
const isHit = ([r, g, b]) => r > b + 50 && r > g + 20;

let temporary, browser, url;

before(async () => {
  temporary = temporaryFolder();
  const folder = temporary.folder;
  const scans = join(folder, 'scans');
  sample(scans, '--families', 'human,mug', '--count', '2', '--points', '3000');
  const scan = join(folder, 'again.xyz');
  scanAgain(join(scans, 'human/human_01.ply'), scan);
  const server = await startServer(join(folder, 'data'));
  try {
    server.command('add', scans, '--base', scans, '--label-from-folder', '--wait');
    server.command('report', scan, '-k', '3', '-o', join(folder, 'report.html'));
  } finally {
    await server.stop();
  }
  url = pathToFileURL(join(folder, 'report.html')).href;
  browser = await startBrowser();
});

after(async () => {
  await browser?.close();
  temporary?.remove();
});

/** A test with a page of its own, which asks nobody for anything. */
function reportTest(name, run, options) {
  test(name, async () => {
    const { page, faults, close } = await openPage(browser, { url }, options);
    try {
      await page.goto(url);
      await page.evaluate(() => new Promise((resolve) => requestAnimationFrame(() => requestAnimationFrame(resolve))));
      await run(page);
      assert.deepEqual(faults, []);
    } finally {
      await close();
    }
  });
}

const drawn = async (page) => {
  await page.evaluate(() => new Promise((resolve) => requestAnimationFrame(() => requestAnimationFrame(resolve))));
  const pixels = await pixelsOf(page, 'canvas');
  return { query: boxOf(pixels, isQuery), hit: boxOf(pixels, isHit) };
};

reportTest('the query and its best hit lie on each other, with the reasons beside them', async (page) => {
  assert.equal(await page.locator('article').count(), 3);
  assert.match(await page.locator('article.chosen h2').innerText(), /^1\. human\/human_01$/);
  assert.match(await page.locator('article').first().innerText(), /same object[\s\S]*parts of again\.xyz match/);
  assert.ok(await page.locator('article').first().locator('tr').count() > 5, 'bars');
  const { query, hit } = await drawn(page);
  assert.ok(query.count > 300 && hit.count > 300, `${query.count} and ${hit.count} pixels`);
  for (const side of ['left', 'right', 'top', 'bottom']) {
    assert.ok(Math.abs(query[side] - hit[side]) < 25, `${side}: ${query[side]} and ${hit[side]}`);
  }
  const bar = await page.locator('td.bars .bar').first().boundingBox();
  assert.ok(bar.width > 80, `bars can be read: ${bar.width}`);
});

reportTest('mouse and keys turn it, and other hits can be chosen', async (page) => {
  const before = await drawn(page);
  const box = await page.locator('canvas').boundingBox();
  await page.mouse.move(box.x + 200, box.y + 200);
  await page.mouse.down();
  await page.mouse.move(box.x + 320, box.y + 260, { steps: 4 });
  await page.mouse.up();
  const turned = await drawn(page);
  assert.notDeepEqual(turned.query, before.query);
  await page.locator('#reset').click();
  assert.deepEqual(await drawn(page), before);
  await page.locator('canvas').focus();
  await page.keyboard.press('ArrowLeft');
  assert.notDeepEqual(await drawn(page), before);
  await page.keyboard.press('0');
  await page.keyboard.press('PageDown');
  assert.match(await page.locator('#told').innerText(), /^2\. /);
  await page.locator('canvas').blur();  // the ring around it has the query's colour
  assert.notDeepEqual((await drawn(page)).hit, before.hit);
  assert.ok(Math.abs((await drawn(page)).query.left - before.query.left) < 8, 'one camera for all');
  await page.locator('#show-hit').uncheck();
  assert.equal((await drawn(page)).hit.count, 0);
});

reportTest('fingers turn and zoom it on a phone', async (page) => {
  const before = await drawn(page);
  const box = await page.locator('canvas').boundingBox();
  const session = await page.context().newCDPSession(page);
  const touch = (type, ...points) => session.send('Input.dispatchTouchEvent', {
    type, touchPoints: points.map(([x, y], id) => ({ x: box.x + x, y: box.y + y, id })),
  });
  await touch('touchStart', [100, 100]);
  await touch('touchMove', [160, 120]);
  await touch('touchEnd');
  assert.notDeepEqual((await drawn(page)).query, before.query);
  await page.locator('#reset').click();
  const width = ({ query }) => query.right - query.left;
  await touch('touchStart', [150, 150], [180, 150]);
  await touch('touchMove', [130, 150], [200, 150]);
  await touch('touchEnd');
  assert.ok(width(await drawn(page)) > 1.5 * width(before), 'two fingers zoom');
  assert.ok(await page.evaluate(() => document.documentElement.scrollWidth <= window.innerWidth), 'nothing sticks out');
}, { viewport: { width: 390, height: 780 }, hasTouch: true, isMobile: true });

for (const colorScheme of ['light', 'dark']) {
  reportTest(`everybody can read it: ${colorScheme}`, async (page) => {
    await page.locator('summary').nth(1).click();
    assert.deepEqual(await complaints(page), []);
    const ground = (await pixelsOf(page, 'canvas')).at(3, 3);
    assert.equal(ground[0] > 128, colorScheme === 'light');
  }, { colorScheme });
}
