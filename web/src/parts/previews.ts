// SPDX-License-Identifier: Apache-2.0
// Points for small pictures, fetched for many shapes at a time and kept.
import { call, follow } from '../api/connect';
import { isCancelled } from '../api/failure';
import { joinPositions, positionsFrom } from '../cloud/cloud';
import { ShapeService } from '../../gen/shapedb/v1/shape_service_pb';
import type { Preview } from '../view/thumbnail';

const kPoints = 1_000;
const kBatch = 60;
const kGatherMilliseconds = 15;
const kMostKept = 3_000;

export interface ShapeName {
  collection: string;
  key: string;
  /** Of the shape: a changed one has another picture. */
  version: bigint;
}

interface Wanted {
  name: ShapeName;
  resolve: (preview: Preview | undefined) => void;
}

const kept = new Map<string, Preview>();
let gathered: Wanted[] = [];

/** Undefined: there is no picture of it (yet). Never rejects: a picture is no reason to stop. */
export function previewOf(name: ShapeName): Promise<Preview | undefined> {
  const known = kept.get(idOf(name));
  if (known !== undefined) return Promise.resolve(known);
  return new Promise((resolve) => {
    gathered.push({ name, resolve });
    if (gathered.length === 1) setTimeout(fetchGathered, kGatherMilliseconds);
  });
}

function idOf(name: ShapeName): string {
  return JSON.stringify([name.collection, name.key, String(name.version)]);
}

function fetchGathered(): void {
  const all = gathered;
  gathered = [];
  const collections = new Set(all.map((one) => one.name.collection));
  for (const collection of collections) {
    const wanted = all.filter((one) => one.name.collection === collection);
    for (let at = 0; at < wanted.length; at += kBatch) void fetchBatch(collection, wanted.slice(at, at + kBatch));
  }
}

async function fetchBatch(collection: string, wanted: Wanted[]): Promise<void> {
  const found = new Map<string, Preview>();
  try {
    const keys = wanted.map((one) => one.name.key);
    const answer = await call(ShapeService.method.getPreviews, { collection, keys, maxPoints: kPoints });
    for (const { key, xyz, normals } of answer.previews) {
      if (xyz.length > 0) found.set(key, { positions: positionsFrom(xyz), normals: new Int8Array(normals) });
    }
  } catch {
    // The listing itself tells what is wrong with the server.
  }
  for (const { name, resolve } of wanted) {
    const preview = found.get(name.key);
    if (preview !== undefined) keep(name, preview);
    resolve(preview);
  }
}

function keep(name: ShapeName, preview: Preview): void {
  kept.set(idOf(name), preview);
  for (const oldest of kept.keys()) {
    if (kept.size <= kMostKept) break;
    kept.delete(oldest);
  }
}

/** A picture of a shape that has no surface points: some points of the scan itself. */
export async function previewOfPoints(name: ShapeName, signal: AbortSignal): Promise<Preview | undefined> {
  try {
    const parts: Float32Array[] = [];
    const shape = { collection: name.collection, key: name.key };
    await follow(ShapeService.method.getPoints, { shape, maxPoints: BigInt(kPoints) }, (answer) => {
      if (answer.part.case === 'chunk') parts.push(positionsFrom(answer.part.value.xyz));
    }, { signal });
    const preview = { positions: joinPositions(parts), normals: new Int8Array() };
    keep(name, preview);
    return preview;
  } catch (error) {
    if (isCancelled(error)) throw error;
    return undefined;
  }
}
