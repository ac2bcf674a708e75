// SPDX-License-Identifier: Apache-2.0
// Keys that do something wherever the focus is, unless somebody is writing.
import { currentAddress, goTo, parentOf } from '../address';
import { showKeys } from './dialogs';

function isWriting(target: EventTarget | null): boolean {
  return target instanceof HTMLElement && target.matches('input, select, textarea, [contenteditable]');
}

export function listenToKeys(): void {
  document.addEventListener('keydown', (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || document.querySelector('dialog') !== null) return;
    if (event.key === 'Escape' && isWriting(event.target)) return (event.target as HTMLElement).blur();
    if (isWriting(event.target)) return;
    const act = actions[event.key];
    if (act !== undefined) {
      event.preventDefault();
      act();
    } else if (event.key.startsWith('Arrow')) {
      moveAmongCards(event);
    }
  });
}

const actions: Record<string, () => void> = {
  '/': () => document.getElementById('find')?.focus(),
  'u': () => document.getElementById('file')?.click(),
  '?': showKeys,
  'Escape': () => goTo(parentOf(currentAddress())),
};

/** From picture to picture, as they stand on the screen. */
function moveAmongCards(event: KeyboardEvent): void {
  const cards = [...document.querySelectorAll<HTMLElement>('.wall .card')];
  const at = cards.indexOf(document.activeElement as HTMLElement);
  if (at < 0 && event.key !== 'ArrowDown' && event.key !== 'ArrowRight') return;
  const top = cards[0]?.getBoundingClientRect().top;
  const columns = Math.max(cards.filter((card) => card.getBoundingClientRect().top === top).length, 1);
  const steps: Record<string, number> = { ArrowLeft: -1, ArrowRight: 1, ArrowUp: -columns, ArrowDown: columns };
  const next = cards[at < 0 ? 0 : at + (steps[event.key] ?? 0)];
  if (next === undefined) return;
  event.preventDefault();
  next.focus();
  next.scrollIntoView({ block: 'nearest' });
}
