// SPDX-License-Identifier: Apache-2.0
// The page: reads the address, shows the view it names, and listens for scans that are dropped.
import type { Address, PageName } from './address';
import { currentAddress, goTo, kPages } from './address';
import { call } from './api/connect';
import { Failure } from './api/failure';
import { apiKey } from './api/session';
import { fill, h } from './dom';
import { askForKey } from './parts/dialogs';
import { header } from './parts/header';
import { listenToKeys } from './parts/keyboard';
import { empty, failed, loading } from './parts/status';
import { applyTheme } from './parts/theme';
import { adminView } from './pages/admin';
import { compareView } from './pages/compare';
import { familiesView } from './pages/families';
import { likeView } from './pages/like';
import { scanView } from './pages/scan';
import { shapeView } from './pages/shape';
import { shapesView } from './pages/shapes';
import { dropScan } from './scan_session';
import type { View, ViewMaker } from './view';
import type { Collection } from '../gen/shapedb/v1/collection_service_pb';
import { CollectionService } from '../gen/shapedb/v1/collection_service_pb';

const kViews: Record<PageName, ViewMaker> = {
  shapes: shapesView, shape: shapeView, like: likeView, compare: compareView, scan: scanView, families: familiesView,
  admin: adminView,
};

const top = h('div', {});
const main = h('main', { id: 'main', tabindex: -1 });
let running = new AbortController();
let shown: View | undefined;
/** As they were last told. */
let collections: Collection[] = [];

async function show(): Promise<void> {
  running.abort();
  running = new AbortController();
  const { signal } = running;
  shown?.dispose?.();
  shown = undefined;
  const focused = document.activeElement?.id ?? '';
  // A view that names its collection need not wait for the list of all.
  const early = currentAddress().collection !== '' && collections.length > 0;
  if (early) showIn(currentAddress(), signal, focused);
  else if (main.childElementCount === 0) fill(main, loading('The collections are being read'));
  try {
    ({ collections } = await call(CollectionService.method.listCollections, {}, { signal }));
  } catch (error) {
    if (!signal.aborted && !early) refuse(error);
    return;
  }
  if (signal.aborted) return;
  if (early) refreshHeader(currentAddress());
  else showIn(withCollection(currentAddress()), signal, focused);
}

function fillHeader(address: Address): void {
  fill(top, header(address, collections, { openScan, askForKey: () => askForKey(() => void show()) }));
}

/** Unless somebody is at it. */
function refreshHeader(address: Address): void {
  if (!top.contains(document.activeElement)) fillHeader(address);
}

function showIn(address: Address, signal: AbortSignal, focused: string): void {
  fillHeader(address);
  if (address.collection === '' && address.unknown === undefined && address.page !== 'admin') {
    fill(main, empty('There is no collection yet', 'Make one with ', h('code', {}, 'shapedb collection create NAME'),
      ' and add scans with ', h('code', {}, 'shapedb add FOLDER --collection NAME'), '.'));
    return;
  }
  shown = address.unknown === undefined ? kViews[address.page](address, signal) : noSuchView(address.unknown);
  document.title = `${shown.title} · ShapeDB`;
  fill(main, shown.element);
  main.dataset['shown'] = location.hash;
  const again = focused === '' ? null : document.getElementById(focused);
  if (again !== null) again.focus();
  else if (focused !== '' || document.activeElement === document.body) main.focus({ preventScroll: true });
}

function noSuchView(name: string): View {
  return { title: 'No such view', element: h('div', { class: 'content narrow' }, empty(`There is no view “${name}”`,
    `Those of this page are ${kPages.join(', ')}. `, h('a', { href: '#/' }, 'To the shapes'))) };
}

/** Without a collection in the address: the first that has shapes. */
function withCollection(address: Address): Address {
  if (address.collection !== '') return address;
  const first = collections.find(({ shapes }) => shapes > 0n) ?? collections[0];
  return { ...address, collection: first?.name ?? '' };
}

function refuse(error: unknown): void {
  fillHeader(currentAddress());
  if (!(error instanceof Failure) || error.code !== 'unauthenticated') {
    fill(main, failed(error, () => void show()));
    return;
  }
  const ask = () => askForKey(() => void show());
  fill(main, empty('An API key is needed', apiKey() === '' ? 'This server answers to those who have one. '
    : 'The server does not know this key, or it has expired or was revoked. ',
    h('button', { type: 'button', onclick: ask }, 'Enter a key')));
  ask();
}

function openScan(file: File): void {
  dropScan(file);
  const address = currentAddress();
  const collection = address.collection || (document.querySelector<HTMLSelectElement>('#collection')?.value ?? '');
  const target: Address = { page: 'scan', collection, keys: [], options: {} };
  if (address.page === 'scan' && address.keys.length === 0) void show();
  else goTo(target);
}

function listenToDrops(): void {
  const over = (on: boolean) => document.body.classList.toggle('dropping', on);
  document.addEventListener('dragover', (event) => {
    event.preventDefault();
    over(true);
  });
  document.addEventListener('dragleave', (event) => event.relatedTarget === null && over(false));
  document.addEventListener('drop', (event) => {
    event.preventDefault();
    over(false);
    const file = event.dataTransfer?.files[0];
    if (file !== undefined) openScan(file);
  });
}

applyTheme();
document.body.append(
  h('a', { class: 'skip', href: '#main', onclick: (event) => {
    event.preventDefault();
    main.focus();
  } }, 'To the content'),
  top, main, h('div', { class: 'drop-here', 'aria-hidden': 'true' }, 'Drop the scan to search with it'));
addEventListener('hashchange', () => void show());
listenToKeys();
listenToDrops();
void show();
