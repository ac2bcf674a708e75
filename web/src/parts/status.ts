// SPDX-License-Identifier: Apache-2.0
// The states in which there is nothing to show yet, or at all.
import { Failure, isCancelled, messageOf } from '../api/failure';
import type { Child } from '../dom';
import { fill, h } from '../dom';

export function loading(what: string): HTMLElement {
  return h('p', { class: 'status loading', role: 'status' }, h('span', { class: 'spinner', 'aria-hidden': 'true' }), what);
}

/** Nothing there: why, and what one could do. */
export function empty(title: string, ...advice: Child[]): HTMLElement {
  return h('div', { class: 'status empty', role: 'status' }, h('h2', {}, title), h('p', {}, ...advice));
}

export function failed(error: unknown, retry?: () => void): HTMLElement {
  const code = error instanceof Failure ? error.code.replace(/_/g, ' ') : 'error';
  return h('div', { class: 'status error', role: 'alert' },
    h('h2', {}, headline(code)),
    h('p', {}, messageOf(error)),
    retry && h('button', { type: 'button', onclick: retry }, 'Try again'));
}

function headline(code: string): string {
  const known: Record<string, string> = {
    'unreachable': 'The server does not answer',
    'not found': 'Not found',
    'unauthenticated': 'An API key is needed',
    'permission denied': 'This key may not do that',
    'invalid argument': 'The server did not accept this',
    'resource exhausted': 'Too much at once',
    'failed precondition': 'Not possible now',
  };
  return known[code] ?? 'Something went wrong';
}

/** Fills `place` with what `load` makes; meanwhile and otherwise with one of the above. */
export async function fillWhenLoaded(
  place: HTMLElement, what: string, signal: AbortSignal, load: () => Promise<Child[]>,
): Promise<void> {
  place.setAttribute('aria-busy', 'true');
  fill(place, loading(what));
  try {
    const children = await load();
    if (!signal.aborted) fill(place, ...children);
  } catch (error) {
    if (signal.aborted || isCancelled(error)) return;
    fill(place, failed(error, () => void fillWhenLoaded(place, what, signal, load)));
  } finally {
    place.removeAttribute('aria-busy');
  }
}
