// SPDX-License-Identifier: Apache-2.0
// A server with shapes in it, and a browser that looks at its page.
import { execFileSync, spawn } from 'node:child_process';
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { tmpdir } from 'node:os';
import { join } from 'node:path';

const require = createRequire(new URL('../../web/package.json', import.meta.url));
const { chromium } = require('playwright-core');
const axe = require('axe-core');

const shapedbd = process.env.SHAPEDBD ?? 'build/bin/shapedbd';
const shapedb = process.env.SHAPEDB ?? 'build/bin/shapedb';
export const kWait = 30_000;  // ms: machines of CI are slow

/** A folder that is removed by `remove`. */
export function temporaryFolder() {
  const folder = mkdtempSync(join(tmpdir(), 'shapedb-web-'));
  return { folder, remove: () => rmSync(folder, { recursive: true, force: true }) };
}

export function sample(folder, ...options) {
  execFileSync(shapedb, ['sample', folder, ...options], { stdio: 'ignore' });
}

/** Another scan of the same object, as a file of lines: two of three points, turned, twice as large, elsewhere. */
export function scanAgain(ply, xyz) {
  const bytes = readFileSync(ply);
  const kEnd = 'end_header\n';
  const header = bytes.toString('latin1', 0, bytes.indexOf(kEnd) + kEnd.length);
  const count = Number(/element vertex (\d+)/.exec(header)[1]);
  const stride = 4 * header.match(/property float/g).length;
  const lines = [];
  for (let i = 0; i < count; ++i) {
    if (i % 3 === 0) continue;
    const [x, y, z] = [0, 4, 8].map((at) => bytes.readFloatLE(header.length + i * stride + at));
    const [c, s] = [Math.cos(0.7), Math.sin(0.7)];
    lines.push([2 * (c * x - s * z) + 5, 2 * y - 3, 2 * (s * x + c * z)].join(' '));
  }
  writeFileSync(xyz, `${lines.join('\n')}\n`);
}

/** Also keeps what the server says, for tests that fail. */
export async function startServer(data, ...options) {
  const server = spawn(shapedbd,
    ['--data', data, '--listen', '127.0.0.1:0', '--http-listen', '127.0.0.1:0', ...options]);
  let said = '';
  const ready = new Promise((resolve, reject) => {
    const timer = setTimeout(() => reject(new Error(`the server does not start: ${said}`)), kWait);
    const listen = (bytes) => {
      said += bytes;
      const grpc = /listening on (\S+)/.exec(said)?.[1];
      const http = /http on (\S+)/.exec(said)?.[1];
      if (grpc === undefined || http === undefined) return;
      clearTimeout(timer);
      resolve({ grpc, http });
    };
    server.stdout.on('data', listen);
    server.stderr.on('data', listen);
    server.on('exit', (code) => reject(new Error(`the server ended with ${code}: ${said}`)));
  });
  const { grpc, http } = await ready;
  const stopped = new Promise((resolve) => server.on('exit', resolve));
  return {
    url: http,
    command: (...words) => execFileSync(shapedb, ['--server', grpc, ...words], { encoding: 'utf8', stdio: ['ignore', 'pipe', 'pipe'] }),
    stop: () => {
      server.kill('SIGTERM');
      return stopped;
    },
  };
}

export function createKey(data, role) {
  return execFileSync(shapedbd, ['key', 'create', '--data', data, '--name', 'test', '--role', role], { encoding: 'utf8' }).trim();
}

export async function startBrowser() {
  return chromium.launch({
    executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium', args: ['--no-sandbox', '--disable-gpu', '--disable-dev-shm-usage'],
  });
}

/** A page that notes everything that should not happen: errors, violations of the CSP, requests to others. */
export async function openPage(browser, server, options = {}) {
  const context = await browser.newContext({ viewport: { width: 1280, height: 860 }, ...options });
  const page = await context.newPage();
  page.setDefaultTimeout(kWait);
  const faults = [];
  page.on('pageerror', (error) => faults.push(error.message));
  page.on('console', (message) => {
    if (message.type() === 'error' && !/status of 4\d\d|ERR_CONNECTION_REFUSED/.test(message.text())) faults.push(message.text());
  });
  page.on('request', (request) => {
    if (!request.url().startsWith(server.url) && !/^(data|blob):/.test(request.url())) faults.push(`asks ${request.url()}`);
  });
  return { page, faults, close: () => context.close() };
}

/** Until nothing is being loaded any more. */
export async function settled(page) {
  await page.waitForFunction(() => document.querySelector('.loading, [aria-busy], .stages .now') === null);
  await page.evaluate(() => new Promise((resolve) => requestAnimationFrame(() => requestAnimationFrame(resolve))));
}

export async function visit(page, server, address) {
  await page.goto(`${server.url}/${address}`);
  await page.waitForFunction((hash) => document.querySelector('main')?.dataset.shown === hash, address);
  await settled(page);
}

/** The pixels of an element as the screen shows them: [r, g, b] of (x, y), and how large it is. */
export async function pixelsOf(page, selector) {
  const png = (await page.locator(selector).first().screenshot()).toString('base64');
  const { width, height, bytes } = await page.evaluate(async (data) => {
    const image = new Image();
    image.src = `data:image/png;base64,${data}`;
    await image.decode();
    const canvas = document.createElement('canvas');
    canvas.width = image.width;
    canvas.height = image.height;
    const context = canvas.getContext('2d');
    context.drawImage(image, 0, 0);
    const pixels = context.getImageData(0, 0, image.width, image.height).data;
    let text = '';
    for (let i = 0; i < pixels.length; i += 0x8000) text += String.fromCharCode(...pixels.subarray(i, i + 0x8000));
    return { width: image.width, height: image.height, bytes: btoa(text) };
  }, png);
  const rgba = Buffer.from(bytes, 'base64');
  return { width, height, at: (x, y) => [...rgba.subarray(4 * (y * width + x), 4 * (y * width + x) + 3)] };
}

/** The box of the pixels that `is` accepts, and how many they are. */
export function boxOf(pixels, is) {
  const box = { left: Infinity, right: -Infinity, top: Infinity, bottom: -Infinity, count: 0 };
  for (let y = 0; y < pixels.height; ++y) {
    for (let x = 0; x < pixels.width; ++x) {
      if (!is(pixels.at(x, y))) continue;
      ++box.count;
      box.left = Math.min(box.left, x);
      box.right = Math.max(box.right, x);
      box.top = Math.min(box.top, y);
      box.bottom = Math.max(box.bottom, y);
    }
  }
  return box;
}

/** What axe-core complains about, in one line each. */
export async function complaints(page) {
  // Not as a script element, which the page's policy would refuse.
  await page.evaluate(axe.source);
  const { violations } = await page.evaluate(() => window.axe.run(document, { resultTypes: ['violations'] }));
  return violations.flatMap(({ id, nodes }) => nodes.map(({ html, failureSummary }) => `${id}: ${html.slice(0, 160)} ${failureSummary}`));
}
