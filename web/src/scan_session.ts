// SPDX-License-Identifier: Apache-2.0
// The scan that was dropped on the page. It stays in this tab: nothing of it is in the address or kept after a reload.
import { sha256 } from './sha256';
import { send } from './api/connect';
import { chunksOf, pointCount } from './cloud/cloud';
import type { Point, Positions } from './cloud/cloud';
import { withoutEnding } from './files/ending';
import type { Choices } from './parts/options';
import { tellStage } from './stages';
import type { OnProgress } from './stages';
import { cloudFrom } from './parts/points';
import type { SegmentedCloud } from './parts/points';
import { decodeFile } from './work';
import type { Collection } from '../gen/shapedb/v1/collection_service_pb';
import type { SearchResponse } from '../gen/shapedb/v1/search_service_pb';
import { SearchService } from '../gen/shapedb/v1/search_service_pb';
import type { AddShapeResponse } from '../gen/shapedb/v1/shape_service_pb';
import { AddMode, ShapeService } from '../gen/shapedb/v1/shape_service_pb';

export interface ScanSession {
  /** Of the file, without its ending. */
  name: string;
  /** Relative to the origin. */
  positions: Positions;
  origin: Point;
  /** What there is to say about how the file was read. */
  notes: string[];
  /** By the parameters of a collection, whose name is the key. */
  segmented: Map<string, SegmentedCloud>;
  /** By collection and options. */
  found: Map<string, SearchResponse>;
}

let current: ScanSession | undefined;
let pending: File | undefined;

export function scanSession(): ScanSession | undefined {
  return current;
}

/** To be read by the view of scans. */
export function dropScan(file: File): void {
  pending = file;
  current = undefined;
}

export function droppedFile(): File | undefined {
  return pending;
}

export async function readDropped(onProgress: OnProgress): Promise<ScanSession> {
  const file = pending!;
  onProgress('The file is being read, here in the browser');
  const scan = await decodeFile(file);
  const notes = [`${pointCount(scan.positions).toLocaleString('en')} points`];
  if (scan.sampled) notes.push('a sample of the surface in the file');
  if (scan.skipped > 0) notes.push(`${scan.skipped.toLocaleString('en')} points without finite coordinates left out`);
  if (scan.origin.some((value) => value !== 0)) notes.push(`sent relative to about ${scan.origin.map((value) => Number(value.toPrecision(6))).join(', ')}`);
  for (const list of scan.ignored) notes.push(`passed over: ${list}`);
  current = {
    name: withoutEnding(file.name), positions: scan.positions, origin: scan.origin, notes, segmented: new Map(), found: new Map(),
  };
  pending = undefined;
  return current;
}

/** What every header of an upload says of the points. */
export function pointsOf({ positions, origin: [x, y, z] }: Pick<ScanSession, 'positions' | 'origin'>) {
  return { pointCount: BigInt(pointCount(positions)), ...(x !== 0 || y !== 0 || z !== 0 ? { origin: { x, y, z } } : {}) };
}

function* requests<H, C>(header: H, positions: Positions, chunk: (xyz: Uint8Array) => C): Generator<H | C> {
  yield header;
  for (const xyz of chunksOf(positions)) yield chunk(xyz);
}

const chunkPart = (xyz: Uint8Array) => ({ part: { case: 'chunk' as const, value: { xyz } } });

function sending(onProgress: OnProgress, after: string): (share: number) => void {
  return (share) => (share < 1 ? onProgress('Points are being sent', share) : onProgress(after));
}

const kSent = 'The server checks the points';

/** The scan in segments, as shapes of the collection are. */
export async function segment(
  session: ScanSession, collection: Collection, onProgress: OnProgress, signal: AbortSignal,
): Promise<SegmentedCloud> {
  const known = session.segmented.get(collection.name);
  if (known !== undefined) return known;
  const header = {
    part: {
      case: 'header' as const,
      value: {
        ...pointsOf(session),
        profile: collection.profile,
        ...(collection.segmentation && { segmentation: collection.segmentation }),
        ...(collection.signature && { signature: collection.signature }),
        reportStages: true,
      },
    },
  };
  const answers = await send(ShapeService.method.segment, requests(header, session.positions, chunkPart),
    {
      signal, onSent: sending(onProgress, kSent),
      onAnswer: ({ part }) => part.case === 'stage' && tellStage(onProgress, part.value),
    });
  const cloud = cloudFrom(answers);
  session.segmented.set(collection.name, cloud);
  return cloud;
}

export async function search(
  session: ScanSession, options: { collection: string; k: number; filter: string } & Partial<Choices>,
  onProgress: OnProgress, signal: AbortSignal,
): Promise<SearchResponse> {
  const id = JSON.stringify(options);
  const known = session.found.get(id);
  if (known !== undefined) return known;
  const { verify, ...others } = options;
  const header = {
    part: {
      case: 'header' as const,
      value: {
        options: { ...others, ...(verify === undefined ? {} : { verify }) },
        ...pointsOf(session),
      },
    },
  };
  const answers = await send(SearchService.method.searchByScanInStages, requests(header, session.positions, chunkPart),
    {
      signal, onSent: sending(onProgress, kSent),
      onAnswer: ({ part }) => part.case === 'stage' && tellStage(onProgress, part.value),
    });
  const answer = answers.at(-1)!.part.value as SearchResponse;
  session.found.set(id, answer);
  return answer;
}

/** Stores the scan under a key that must be free. */
export async function store(
  session: ScanSession, collection: string, key: string, onProgress: OnProgress, signal: AbortSignal,
): Promise<AddShapeResponse> {
  const header = {
    part: {
      case: 'header' as const,
      value: {
        collection, key, mode: AddMode.INSERT_ONLY, ...pointsOf(session),
        sha256: await sha256(session.positions),
      },
    },
  };
  const [answer] = await send(ShapeService.method.addShape, requests(header, session.positions, chunkPart),
    { signal, onSent: sending(onProgress, 'The scan is being stored') });
  return answer!;
}
