// SPDX-License-Identifier: Apache-2.0
// The bar above every view: which collection, what to do with it, a scan from a file.
import type { Address, PageName } from '../address';
import { formatAddress, goTo } from '../address';
import { h } from '../dom';
import { count } from '../text';
import { showKeys } from './dialogs';
import { themeButton } from './theme';
import type { Collection } from '../../gen/shapedb/v1/collection_service_pb';

export interface HeaderActions {
  openScan: (file: File) => void;
  askForKey: () => void;
}

const kLinks: { page: PageName; name: string; also: PageName[] }[] = [
  { page: 'shapes', name: 'Shapes', also: ['shape', 'like'] },
  { page: 'families', name: 'Families', also: [] },
  { page: 'compare', name: 'Compare', also: [] },
  { page: 'admin', name: 'Admin', also: [] },
];

export function header(address: Address, collections: Collection[], actions: HeaderActions): HTMLElement {
  const file = h('input', {
    type: 'file', id: 'file', class: 'unseen', tabindex: -1, 'aria-hidden': 'true',
    onchange: () => file.files?.[0] && actions.openScan(file.files[0]),
  });
  return h('header', { class: 'top' },
    h('a', { class: 'brand', href: '#/' }, h('img', { src: 'icon.svg', alt: '', width: 22, height: 22 }), 'ShapeDB'),
    collectionChoice(address, collections),
    h('nav', { 'aria-label': 'Views' }, ...kLinks.map(({ page, name, also }) => h('a', {
      href: formatAddress({ page, collection: address.collection, keys: [], options: {} }),
      'aria-current': address.unknown === undefined && (address.page === page || also.includes(address.page)) ? 'page' : undefined,
    }, name))),
    keySearch(address),
    h('button', { type: 'button', class: 'primary', onclick: () => file.click() }, 'Search with a scan'), file,
    h('span', { class: 'icons' },
      themeButton(),
      h('button', { type: 'button', class: 'plain', onclick: actions.askForKey }, 'Key'),
      h('button', { type: 'button', class: 'icon', title: 'Keyboard', 'aria-label': 'Keyboard', onclick: showKeys }, '?')));
}

function collectionChoice(address: Address, collections: Collection[]): HTMLElement {
  const choice = h('select', {
    id: 'collection', 'aria-label': 'Collection',
    onchange: () => goTo({ page: address.page === 'admin' ? 'admin' : 'shapes', collection: choice.value, keys: [], options: {} }),
  }, ...collections.map(({ name, shapes }) =>
    h('option', { value: name, selected: name === address.collection }, `${name} (${count(shapes)})`)));
  if (!collections.some(({ name }) => name === address.collection) && address.collection !== '') {
    choice.prepend(h('option', { value: address.collection, selected: true }, address.collection));
  }
  return choice;
}

/** To the shape with the key, or to those whose keys begin so. */
function keySearch(address: Address): HTMLElement {
  const field = h('input', {
    type: 'search', id: 'find', placeholder: 'Find a key  ( / )', 'aria-label': 'Find shapes by the beginning of their key',
    autocomplete: 'off', spellcheck: 'false', value: address.options['prefix'] ?? '',
  });
  return h('form', {
    class: 'find', role: 'search', onsubmit: (event) => {
      event.preventDefault();
      goTo({ page: 'shapes', collection: address.collection, keys: [], options: { prefix: field.value } });
    },
  }, field);
}
