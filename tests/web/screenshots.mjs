// SPDX-License-Identifier: Apache-2.0
// node tests/web/screenshots.mjs FOLDER: the pictures of docs/web.md, of made-up shapes (`shapedb sample`). Needs
// SHAPEDBD, SHAPEDB and web/node_modules as the tests do.
import { mkdirSync } from 'node:fs';
import { join } from 'node:path';

import { openPage, sample, scanAgain, settled, startBrowser, startServer, temporaryFolder, visit } from './harness.mjs';

const out = process.argv[2];
mkdirSync(out, { recursive: true });
const { folder, remove } = temporaryFolder();
const scans = join(folder, 'scans');
const scan = join(folder, 'found-in-the-attic.xyz');
sample(scans, '--count', '3', '--points', '6000');
scanAgain(join(scans, 'human/human_02.ply'), scan);
const [server, browser] = await Promise.all([startServer(join(folder, 'data')), startBrowser()]);
try {
  server.command('collection', 'create', 'models');
  server.command('add', scans, '--base', scans, '--collection', 'models', '--label-from-folder', '--wait');

  const shoot = async (page, name) => {
    await settled(page);
    await page.waitForTimeout(500);  // pictures are drawn as they come into view
    await page.screenshot({ path: join(out, `web-${name}.png`) });
  };
  const seen = async (name, address, options, act) => {
    const { page, close } = await openPage(browser, server, { viewport: { width: 1200, height: 760 }, ...options });
    await visit(page, server, address);
    await act?.(page);
    await shoot(page, name);
    await close();
  };
  const drop = async (page) => {
    await page.setInputFiles('#file', scan);
    await page.locator('.hit').first().waitFor();
  };
  await seen('wall', '#/shapes/models');
  await seen('scan', '#/shapes/models', {}, drop);
  await seen('hit', '#/shapes/models', {}, async (page) => {
    await drop(page);
    await page.locator('.hit').nth(1).click();
    await page.locator('.overlay-controls').waitFor();
    await page.getByLabel('distance').check();
    await page.getByText('of the query is nearer than').waitFor();
  });
  await seen('segments', '#/compare/models/animal%2Fanimal_01/animal%2Fanimal_02', { colorScheme: 'dark' }, async (page) => {
    await page.locator('.overlay-controls').waitFor();
    await page.getByLabel('matched segments').check();
    await page.getByLabel('side by side').check();
  });
  await seen('families', '#/families/models', {}, async (page) => {
    await page.locator('.matrix').scrollIntoViewIfNeeded();
    await page.locator('.matrix').hover({ position: { x: 60, y: 40 } });
  });
  await seen('phone', '#/like/models/human%2Fhuman_02', { viewport: { width: 390, height: 760 } });
} finally {
  await browser.close();
  await server.stop();
  remove();
}
