// SPDX-License-Identifier: Apache-2.0
// A scan that was dropped on the page: read, sent, shown in segments, searched with, and stored if wanted.
import type { Address } from '../address';
import { formatAddress, linkTo } from '../address';
import { call, follow } from '../api/connect';
import { isCancelled } from '../api/failure';
import { frameOf, normalised, thinned } from '../cloud/cloud';
import { coloured, kQuery } from '../cloud/palette';
import { fill, h } from '../dom';
import { facts } from '../parts/facts';
import { kSearchOptions, switches } from '../parts/options';
import { fillOverlay } from '../parts/overlay';
import { pictureHint, viewerIn } from '../parts/large_picture';
import { Progress } from '../parts/progress';
import type { SegmentedCloud } from '../parts/points';
import { kPointsAtFirst, storedCloud } from '../parts/points';
import { empty, failed, fillWhenLoaded, loading } from '../parts/status';
import { motionOf, why } from '../parts/why';
import type { ScanSession } from '../scan_session';
import { droppedFile, readDropped, scanSession, search, segment, store } from '../scan_session';
import { filterField, hits, searchOptionsOf } from './like';
import { segmentList, showSegments } from './shape';
import { stageInWords, tellStage } from '../stages';
import { seconds } from '../text';
import type { View } from '../view';
import { CollectionService } from '../../gen/shapedb/v1/collection_service_pb';
import { ShapeService } from '../../gen/shapedb/v1/shape_service_pb';
import type { SegmentationReport, StageTime } from '../../gen/shapedb/v1/types_pb';
import { ShapeState } from '../../gen/shapedb/v1/types_pb';

/** Drawn of a scan at hand. */
const kMostDrawn = 1_000_000;

export function scanView(address: Address, signal: AbortSignal): View {
  if (scanSession() === undefined && droppedFile() === undefined) return noScan();
  const hit = address.keys[0] ?? '';
  const place = h('div', {});
  void run(place, address, hit, signal);
  return { title: hit === '' ? 'A scan' : `${hit} on a scan`, element: place };
}

function noScan(): View {
  return {
    title: 'A scan',
    element: h('div', { class: 'content narrow' }, h('h1', {}, 'Search with a scan'), empty('Drop a scan here',
      'A file with points or a surface: .ply .pcd .obj .stl .off .xyz .txt. It is read in this browser; only its points are ' +
      'sent to the server, and nothing is stored unless you say so. After a reload the page has forgotten it.')),
  };
}

async function run(place: HTMLElement, address: Address, hit: string, signal: AbortSignal): Promise<void> {
  const progress = new Progress();
  fill(place, h('div', { class: 'content narrow' }, h('h1', {}, 'A scan'), progress.element));
  try {
    const session = scanSession() ?? (await readDropped(progress.tell));
    if (signal.aborted) return;
    if (hit === '') showScan(place, session, address, signal);
    else await showHit(place, session, address, hit, progress, signal);
  } catch (error) {
    if (!signal.aborted && !isCancelled(error)) fill(place, h('div', { class: 'content narrow' }, failed(error)));
  }
}

/** The scan, as points at once and in segments later; the hits below. */
function showScan(place: HTMLElement, session: ScanSession, address: Address, signal: AbortSignal): void {
  const stage = h('div', { class: 'stage low' });
  const about = h('div', { class: 'panel' });
  const results = h('div', { class: 'results' });
  fill(place,
    h('div', { class: 'with-panel' },
      h('div', { class: 'content' }, h('h1', {}, session.name), stage, pictureHint()), about),
    h('div', { class: 'content' }, h('h2', {}, `Like it in ${address.collection}`),
      switches(address, ['partial', 'mirror', 'size', 'verify'], signal), filterField(address), results));
  const viewer = viewerIn(stage, `${session.name}, coloured by segment`, signal);
  const points = thinned(session.positions, kMostDrawn);
  viewer?.addLayer(normalised(points, frameOf(points)), coloured(points.length / 3, () => kQuery));
  viewer?.look();
  void fillSegments(viewer, about, session, address, signal);
  void fillHits(results, session, address, signal);
}

async function collectionOf(address: Address, signal: AbortSignal) {
  return call(CollectionService.method.getCollection, { name: address.collection }, { signal });
}

async function fillSegments(
  viewer: ReturnType<typeof viewerIn>, about: HTMLElement, session: ScanSession, address: Address, signal: AbortSignal,
): Promise<void> {
  const progress = new Progress();
  const notes = h('p', { class: 'faint' }, session.notes.join(', '));
  fill(about, storeForm(session, address, signal), notes, progress.element);
  try {
    const cloud = await segment(session, await collectionOf(address, signal), progress.tell, signal);
    if (signal.aborted) return;
    showSegments(viewer, drawable(cloud));
    progress.element.replaceWith(h('div', {}, ...doubts(cloud.report), ...segmentList(cloud), stageTimes(cloud.report)));
  } catch (error) {
    if (!signal.aborted && !isCancelled(error)) progress.element.replaceWith(failed(error));
  }
}

function drawable(cloud: SegmentedCloud): SegmentedCloud {
  if (cloud.segments.length <= kMostDrawn) return cloud;
  const step = cloud.segments.length / kMostDrawn;
  return {
    ...cloud,
    positions: thinned(cloud.positions, kMostDrawn),
    segments: Int32Array.from({ length: kMostDrawn }, (_, i) => cloud.segments[Math.floor(i * step)]!),
  };
}

/** What the server did one after the other. */
function stageTimes(report: SegmentationReport | undefined): HTMLElement | null {
  if (report === undefined || report.stages.length === 0) return null;
  return h('details', {}, h('summary', {}, `Segmented in ${seconds(report.totalSeconds)}, stage by stage`),
    facts(Array.from(timesInWords(report.stages), ([words, spent]) => [words, seconds(spent)])));
}

function timesInWords(stages: StageTime[]): Map<string, number> {
  const times = new Map<string, number>();
  for (const { stage, seconds: spent } of stages) {
    const words = stageInWords(stage);
    times.set(words, (times.get(words) ?? 0) + spent);
  }
  return times;
}

/** What one should know before relying on the segments. */
function doubts(report: SegmentationReport | undefined): HTMLElement[] {
  const quality = report?.quality;
  if (quality === undefined) return [];
  const text = `Quality ${quality.toFixed(2)} of 1`;
  if (quality >= 0.5) return [h('p', { class: 'note' }, text)];
  return [h('p', { class: 'note bad' }, `${text}: its interior is a guess. Scan more sides, or with less noise.`)];
}

async function fillHits(
  place: HTMLElement, session: ScanSession, address: Address, signal: AbortSignal,
): Promise<void> {
  const progress = new Progress();
  fill(place, progress.element);
  try {
    const response = await search(session, searchOptionsOf(address), progress.tell, signal);
    if (signal.aborted) return;
    fill(place, ...hits(response, address, signal, (key) => linkTo(address, 'scan', [key], kSearchOptions)));
  } catch (error) {
    if (signal.aborted || isCancelled(error)) return;
    fill(place, failed(error, () => void fillHits(place, session, address, signal)));
  }
}

async function showHit(
  place: HTMLElement, session: ScanSession, address: Address, key: string, progress: Progress, signal: AbortSignal,
): Promise<void> {
  const response = await search(session, searchOptionsOf(address), progress.tell, signal);
  const found = response.hits.find((one) => one.shape?.key === key);
  if (signal.aborted) return;
  const back = h('a', { class: 'button', href: formatAddress({ ...address, keys: [] }) }, `All hits of ${session.name}`);
  if (found === undefined) {
    fill(place, h('div', { class: 'content narrow' }, empty(`${key} is not among the hits`, back)));
    return;
  }
  const picture = h('div', { class: 'overlay' }, loading('The points of both are being fetched and segmented'));
  fill(place, h('div', { class: 'with-panel' },
    h('div', { class: 'content' },
      h('h1', {}, h('a', { href: linkTo(address, 'shape', [key]) }, key), ` on ${session.name}`), picture),
    h('div', { class: 'side-panel' }, h('p', {}, back), h('div', { class: 'panel' }, ...why(found)))));
  await fillWhenLoaded(picture, 'The points of both are being fetched and segmented', signal, async () => {
    const collection = await collectionOf(address, signal);
    const [query, hit] = await Promise.all([
      segment(session, collection, () => undefined, signal),
      storedCloud(address.collection, key, kPointsAtFirst, signal),
    ]);
    const inner = h('div', {});
    if (!signal.aborted) {
      fillOverlay(inner, {
        queryName: session.name, hitName: key, query: drawable(query), hit, motion: motionOf(found),
        explanation: found.explanation,
      }, signal);
    }
    return [inner];
  });
}

/** Stores the scan and follows it until it can be found. */
function storeForm(session: ScanSession, address: Address, signal: AbortSignal): HTMLElement {
  const key = h('input', { type: 'text', id: 'store-key', value: session.name, required: true, autocomplete: 'off' });
  const told = h('div', {});
  const submit = async (event: Event) => {
    event.preventDefault();
    const progress = new Progress();
    fill(told, progress.element);
    try {
      await store(session, address.collection, key.value, progress.tell, signal);
      await watch(address.collection, key.value, progress, signal);
      progress.done();
      told.append(h('p', {}, h('a', { href: linkTo(address, 'shape', [key.value]) }, `${key.value} is stored`)));
    } catch (error) {
      if (!signal.aborted && !isCancelled(error)) fill(told, failed(error));
    }
  };
  return h('details', { class: 'store' }, h('summary', {}, `Store it in ${address.collection}`),
    h('form', { class: 'stacked', onsubmit: (event) => void submit(event) },
      h('label', { for: 'store-key' }, 'Key'), key, h('button', { type: 'submit', class: 'primary' }, 'Store')), told);
}

async function watch(collection: string, key: string, progress: Progress, signal: AbortSignal): Promise<void> {
  await follow(ShapeService.method.watchIngest, { shape: { collection, key } }, (event) => {
    if (event.state === ShapeState.FAILED) throw new Error(event.failure?.message ?? 'it could not be segmented');
    if (event.state !== ShapeState.PENDING) return;
    tellStage(progress.tell, event);
  }, { signal });
}
