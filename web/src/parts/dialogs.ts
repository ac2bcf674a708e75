// SPDX-License-Identifier: Apache-2.0
// What is asked and told in front of the page: the API key, and what the keys of the keyboard do.
import { apiKey, setApiKey } from '../api/session';
import { h } from '../dom';

function show(dialog: HTMLDialogElement): void {
  dialog.addEventListener('close', () => dialog.remove());
  document.body.append(dialog);
  dialog.showModal();
}

/** `onChange`: another key is there, or none. */
export function askForKey(onChange: () => void): void {
  if (document.querySelector('dialog') !== null) return;
  const field = h('input', {
    type: 'password', id: 'api-key', autocomplete: 'off', spellcheck: 'false', placeholder: 'shapedb_…', value: apiKey(),
  });
  const take = (key: string) => {
    setApiKey(key);
    dialog.close();
    onChange();
  };
  const dialog = h('dialog', { 'aria-labelledby': 'key-title' },
    h('form', {
      class: 'stacked', onsubmit: (event) => {
        event.preventDefault();
        take(field.value.trim());
      },
    },
      h('h2', { id: 'key-title' }, 'API key'),
      h('p', {}, 'It is kept until this tab is closed, and sent to this server only.'),
      h('label', { for: 'api-key' }, 'Key'), field,
      h('div', { class: 'buttons' },
        h('button', { type: 'button', onclick: () => dialog.close() }, 'Cancel'),
        h('button', { type: 'button', onclick: () => take('') }, 'Forget it'),
        h('button', { type: 'submit', class: 'primary' }, 'Use'))));
  show(dialog);
  field.focus();
}

const kKeys: [string, string][] = [
  ['/', 'find a shape by its key'],
  ['arrow keys', 'among pictures: to the next one; in a large picture: turn it'],
  ['Enter', 'open'],
  ['+ and -', 'in a large picture: nearer and farther'],
  ['u', 'open a scan from a file'],
  ['Escape', 'from a hit to all hits, from there to the shape, from there to the collection'],
  ['?', 'this list'],
];

export function showKeys(): void {
  if (document.querySelector('dialog') !== null) return;
  const dialog: HTMLDialogElement = h('dialog', { 'aria-labelledby': 'keys-title' },
    h('h2', { id: 'keys-title' }, 'Keyboard'),
    h('dl', { class: 'facts' }, ...kKeys.flatMap(([key, what]) => [h('dt', {}, h('kbd', {}, key)), h('dd', {}, what)])),
    h('p', {}, h('a', { href: 'licences.txt', target: '_blank' }, 'Licences of what the page is made of')),
    h('div', { class: 'buttons' }, h('button', { type: 'button', class: 'primary', onclick: () => dialog.close() }, 'Close')));
  show(dialog);
}
