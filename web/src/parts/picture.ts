// SPDX-License-Identifier: Apache-2.0
// The small picture of a shape: drawn when it comes into view, turned by the pointer.
import type { Rgb } from '../cloud/palette';
import { kQuery } from '../cloud/palette';
import { h } from '../dom';
import { drawThumbnail } from '../view/thumbnail';
import type { Preview } from '../view/thumbnail';
import type { ShapeName } from './previews';
import { previewOf, previewOfPoints } from './previews';

const kSide = 176;  // pixels of the drawing, whatever its size on the screen
const kTurn = -0.6;  // radians, at rest

const seen = new IntersectionObserver((entries) => {
  for (const { target, isIntersecting } of entries) {
    if (!isIntersecting) continue;
    seen.unobserve(target);
    target.dispatchEvent(new Event('seen'));
  }
}, { rootMargin: '200px' });

/** Of a stored shape. */
export function pictureOf(name: ShapeName, signal: AbortSignal): HTMLElement {
  const canvas = blank();
  canvas.addEventListener('seen', () => void draw(canvas, name, signal));
  seen.observe(canvas);
  return frame(canvas);
}

/** Of points at hand. */
export function pictureOfPoints(preview: Preview): HTMLElement {
  const canvas = blank();
  show(canvas, preview, kQuery);
  return frame(canvas);
}

function blank(): HTMLCanvasElement {
  return h('canvas', { width: kSide, height: kSide, 'aria-hidden': 'true' });
}

function frame(canvas: HTMLCanvasElement): HTMLElement {
  return h('div', { class: 'picture' }, canvas);
}

async function draw(canvas: HTMLCanvasElement, name: ShapeName, signal: AbortSignal): Promise<void> {
  const preview = (await previewOf(name)) ?? (await previewOfPoints(name, signal).catch(() => undefined));
  if (signal.aborted) return;
  if (preview === undefined || preview.positions.length === 0) canvas.parentElement?.classList.add('without');
  else show(canvas, preview, kQuery);
}

function show(canvas: HTMLCanvasElement, preview: Preview, colour: Rgb): void {
  drawThumbnail(canvas, preview, kTurn, colour);
  canvas.dataset['drawn'] = 'yes';
  canvas.addEventListener('pointermove', (event) => {
    const share = event.offsetX / canvas.clientWidth - 0.5;
    drawThumbnail(canvas, preview, kTurn + share * 2 * Math.PI, colour);
  });
  canvas.addEventListener('pointerleave', () => drawThumbnail(canvas, preview, kTurn, colour));
}
