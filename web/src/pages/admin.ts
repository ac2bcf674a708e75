// SPDX-License-Identifier: Apache-2.0
// The server at work: what it holds, rebuilds, failures with their reasons, keys.
import type { Address } from '../address';
import { formatAddress } from '../address';
import { call, follow } from '../api/connect';
import { Failure, isCancelled } from '../api/failure';
import type { Child } from '../dom';
import { fill, h } from '../dom';
import { bytes, count, counted, moment, seconds } from '../text';
import { facts } from '../parts/facts';
import { empty, failed, fillWhenLoaded } from '../parts/status';
import type { View } from '../view';
import type { Key, StatsResponse } from '../../gen/shapedb/v1/admin_service_pb';
import { AdminService, Role } from '../../gen/shapedb/v1/admin_service_pb';
import type { Collection } from '../../gen/shapedb/v1/collection_service_pb';
import { CollectionService } from '../../gen/shapedb/v1/collection_service_pb';
import { ShapeService } from '../../gen/shapedb/v1/shape_service_pb';
import { LengthUnit, Profile, ShapeState } from '../../gen/shapedb/v1/types_pb';

const kRefreshMilliseconds = 2_000;
const kFailuresShown = 50;
const kNumbers = ['shapes', 'ready', 'failed', 'generation'];  // columns

export function adminView(address: Address, signal: AbortSignal): View {
  const section = (title: string, fillIn: (place: HTMLElement) => Promise<void>) => {
    const place = h('div', {});
    void fillIn(place);
    return h('section', {}, h('h2', {}, title), place);
  };
  const element = h('div', { class: 'content' }, h('h1', {}, 'Administration'),
    section('Server', (place) => showStats(place, signal)),
    section('Collections', (place) => showCollections(place, signal)),
    section(`Failures in ${address.collection}`, (place) => showFailures(place, address.collection, signal)),
    section('API keys', (place) => showKeys(place, signal)));
  return { title: 'Administration', element };
}

/** Again and again, while the view is shown. */
async function showStats(place: HTMLElement, signal: AbortSignal): Promise<void> {
  await fillWhenLoaded(place, 'Reading', signal, async () => {
    const info = await call(AdminService.method.serverInfo, {}, { signal });
    const numbers = h('div', {});
    const refresh = async () => {
      const stats = await call(AdminService.method.stats, {}, { signal });
      fill(numbers, statsFacts(stats));
    };
    await refresh();
    const timer = setInterval(() => void refresh().catch(() => undefined), kRefreshMilliseconds);
    signal.addEventListener('abort', () => clearInterval(timer));
    return [numbers, facts([
      ['version', info.version], ['started', moment(info.started)],
      ['largest scan', `${count(info.limits?.maxPoints ?? 0n)} points`], ['ingest threads', String(info.ingestThreads)],
    ])];
  });
}

function statsFacts(stats: StatsResponse): HTMLElement {
  const tile = (name: string, value: string, bad = false) =>
    h('div', { class: bad ? 'tile bad' : 'tile' }, h('span', { class: 'tile-value' }, value), h('span', {}, name));
  return h('div', { class: 'tiles' },
    tile('shapes ready', count(stats.shapesReady)),
    tile('waiting', count(stats.shapesPending)),
    tile('failed', count(stats.shapesFailed), stats.shapesFailed > 0n),
    tile('being segmented', count(stats.runningJobs)),
    tile('in the queue', `${count(stats.queuedJobs)} (${bytes(stats.queuedBytes)})`),
    tile('on disk', bytes(stats.databaseBytes)),
    tile('searches since start', count(stats.searches)),
    tile('up', seconds(stats.uptimeSeconds)));
}

async function showCollections(place: HTMLElement, signal: AbortSignal): Promise<void> {
  await fillWhenLoaded(place, 'Reading', signal, async () => {
    const { collections } = await call(CollectionService.method.listCollections, {}, { signal });
    return [h('div', { class: 'scroll' }, h('table', { class: 'list' },
      h('thead', {}, h('tr', {}, ...['collection', 'shapes', 'ready', 'failed', 'profile', 'unit', 'generation', 'rebuild']
        .map((name) => h('th', { scope: 'col', class: kNumbers.includes(name) ? 'number' : undefined }, name)))),
      h('tbody', {}, ...collections.map((one) => collectionRow(one, signal)))))];
  });
}

function collectionRow(collection: Collection, signal: AbortSignal): HTMLElement {
  const { name, damage, shapes, shapesReady, shapesFailed, profile, generation, signature } = collection;
  const unit = LengthUnit[signature?.unit ?? LengthUnit.NONE].toLowerCase();
  return h('tr', {},
    h('th', { scope: 'row' }, h('a', { href: formatAddress({ page: 'shapes', collection: name, keys: [], options: {} }) }, name),
      damage !== '' && h('div', { class: 'note bad' }, damage)),
    ...[shapes, shapesReady, shapesFailed].map((value) => h('td', { class: 'number' }, count(value))),
    h('td', {}, Profile[profile].toLowerCase()), h('td', {}, unit), h('td', { class: 'number' }, count(generation)),
    h('td', {}, rebuild(name, signal)));
}

/** A button; once it is pressed, how far the rebuild is and a way to stop it. */
function rebuild(collection: string, signal: AbortSignal): HTMLElement {
  const place = h('div', { class: 'rebuild', 'aria-live': 'polite' });
  const offer = (said: Child = null) =>
    fill(place, h('button', { type: 'button', onclick: () => void start() }, 'Rebuild'), said);
  const start = async () => {
    const bar = h('progress', { 'aria-label': `Rebuild of ${collection}`, max: 1 });
    const said = h('span', {}, 'starting');
    const stop = () => void call(AdminService.method.cancelRebuild, { collection }, { signal }).catch(() => undefined);
    fill(place, bar, said, h('button', { type: 'button', onclick: stop }, 'Stop'));
    try {
      let last = '';
      await follow(AdminService.method.rebuild, { collection }, ({ done, total, failed: bad, seconds: took, finished }) => {
        if (total > 0n) bar.value = Number(done) / Number(total);
        last = `${count(done)} of ${count(total)}${bad > 0n ? `, ${count(bad)} failed` : ''}`;
        said.textContent = last;
        if (finished) last = `done in ${seconds(took)}: ${last}`;
      }, { signal });
      offer(h('span', { class: 'faint' }, last));
    } catch (error) {
      if (signal.aborted || isCancelled(error)) return;
      offer(h('span', { class: 'bad-text', role: 'alert' }, error instanceof Failure ? error.message : String(error)));
    }
  };
  offer();
  return place;
}

async function showFailures(place: HTMLElement, collection: string, signal: AbortSignal): Promise<void> {
  const again = () => showFailures(place, collection, signal);
  await fillWhenLoaded(place, 'Reading', signal, async () => {
    const { shapes, nextCursor } = await call(ShapeService.method.listShapes, {
      collection, state: ShapeState.FAILED, pageSize: kFailuresShown,
    }, { signal });
    if (shapes.length === 0) return [empty('None', 'Every shape of this collection could be segmented.')];
    const said = h('span', { role: 'status' });
    const retry = async (keys: string[]) => {
      try {
        const by = keys.length > 0 ? { case: 'keys' as const, value: { keys } } : { case: 'filter' as const, value: '' };
        const { queued } = await call(ShapeService.method.retryShapes, { collection, selection: { by } }, { signal });
        said.textContent = `${counted(queued, 'shape')} queued again`;
        setTimeout(() => !signal.aborted && void again(), kRefreshMilliseconds);
      } catch (error) {
        if (!isCancelled(error)) fill(said, failed(error));
      }
    };
    return [
      h('p', {}, h('button', { type: 'button', onclick: () => void retry([]) }, 'Retry all'), ' ', said),
      h('div', { class: 'scroll' }, h('table', { class: 'list' },
        h('thead', {}, h('tr', {}, ...['shape', 'error', 'reason', 'retry'].map((name) => h('th', { scope: 'col' }, name)))),
        h('tbody', {}, ...shapes.map(({ key, failure }) => h('tr', {},
          h('th', { scope: 'row' }, h('a', {
            href: formatAddress({ page: 'shape', collection, keys: [key], options: {} }),
          }, key)),
          h('td', {}, h('code', {}, failure?.error)), h('td', {}, failure?.message),
          h('td', {}, h('button', { type: 'button', onclick: () => void retry([key]) }, 'Retry'))))))),
      nextCursor !== '' && h('p', { class: 'faint' }, `The first ${kFailuresShown} are shown.`),
    ];
  });
}

async function showKeys(place: HTMLElement, signal: AbortSignal): Promise<void> {
  const again = () => void showKeys(place, signal);
  await fillWhenLoaded(place, 'Reading', signal, async () => {
    let keys: Key[];
    try {
      keys = (await call(AdminService.method.listKeys, {}, { signal })).keys;
    } catch (error) {
      if (!(error instanceof Failure) || error.code === 'unreachable') throw error;
      return [empty('Keys are not shown', `${error.message}.`)];
    }
    const made = h('div', {});
    return [keyTable(keys, again, signal), keyForm(made, again, signal), made];
  });
}

function keyTable(keys: Key[], again: () => void, signal: AbortSignal): HTMLElement {
  const revoke = async (key: Key) => {
    if (!confirm(`Revoke the key of ${key.name}? From then on nobody can use it.`)) return;
    await call(AdminService.method.revokeKey, { id: key.id }, { signal }).catch(() => undefined);
    again();
  };
  return h('div', { class: 'scroll' }, h('table', { class: 'list' },
    h('thead', {}, h('tr', {}, ...['name', 'id', 'role', 'collections', 'expires', 'scans today', 'revoke']
      .map((name) => h('th', { scope: 'col' }, name)))),
    h('tbody', {}, ...keys.map((key) => h('tr', { class: key.revoked !== undefined ? 'gone' : undefined },
      h('th', { scope: 'row' }, key.name), h('td', {}, h('code', {}, key.id)), h('td', {}, Role[key.role].toLowerCase()),
      h('td', {}, key.collections.length === 0 ? 'all' : key.collections.join(', ')),
      h('td', {}, key.expires === undefined ? 'never' : moment(key.expires)),
      h('td', { class: 'number' }, count(key.scansToday)),
      h('td', {}, key.revoked !== undefined ? `revoked ${moment(key.revoked)}`
        : h('button', { type: 'button', onclick: () => void revoke(key) }, 'Revoke')))))));
}

function keyForm(made: HTMLElement, again: () => void, signal: AbortSignal): HTMLElement {
  const name = h('input', { id: 'key-name', type: 'text', required: true, maxlength: 128, autocomplete: 'off' });
  const role = h('select', { id: 'key-role' }, h('option', { value: Role.READER }, 'reader'),
    h('option', { value: Role.WRITER }, 'writer'), h('option', { value: Role.ADMIN }, 'admin'));
  const create = async (event: Event) => {
    event.preventDefault();
    try {
      const { secret } = await call(AdminService.method.createKey, { name: name.value, role: Number(role.value) }, { signal });
      fill(made, h('div', { class: 'note' }, h('p', {}, 'This is the only time that the key is shown:'),
        h('code', { class: 'secret' }, secret), h('p', {}, h('button', { type: 'button', onclick: again }, 'I have kept it'))));
    } catch (error) {
      if (!isCancelled(error)) fill(made, failed(error));
    }
  };
  return h('details', {}, h('summary', {}, 'Make a key'),
    h('form', { class: 'stacked', onsubmit: (event) => void create(event) },
      h('label', { for: 'key-name' }, 'Whose it is'), name, h('label', { for: 'key-role' }, 'Role'), role,
      h('button', { type: 'submit', class: 'primary' }, 'Make')));
}
