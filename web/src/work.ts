// SPDX-License-Identifier: Apache-2.0
// The page's side of worker.ts.
import type { Scan } from './files/decode';
import type { Outcome, Task } from './worker';

let worker: Worker | undefined;
let lastId = 0;
const waiting = new Map<number, { resolve: (result: never) => void; reject: (error: Error) => void }>();

function theWorker(): Worker {
  if (worker !== undefined) return worker;
  worker = new Worker(new URL('worker.js', document.baseURI), { type: 'module' });
  worker.onmessage = (event: MessageEvent<Outcome>) => {
    const outcome = event.data;
    const { resolve, reject } = waiting.get(outcome.id)!;
    waiting.delete(outcome.id);
    if ('error' in outcome) reject(new Error(outcome.error));
    else resolve(outcome.result as never);
  };
  return worker;
}

function run<R>(task: Task): Promise<R> {
  return new Promise<R>((resolve, reject) => {
    waiting.set(task.id, { resolve, reject });
    theWorker().postMessage(task);
  });
}

/** Rejects with an Error that says what is wrong with the file. */
export async function decodeFile(file: File): Promise<Scan> {
  let bytes: ArrayBuffer;
  try {
    bytes = await file.arrayBuffer();
  } catch {
    throw new Error(`${file.name}: the browser cannot read it: it is too large, or has changed or gone since. \`shapedb query\` reads ` +
      'files of any size');
  }
  return run<Scan>({ id: ++lastId, kind: 'decode', name: file.name, bytes });
}

/** As distancesTo of cloud/nearest.ts. */
export function distancesBetween(from: Float32Array, to: Float32Array, most: number): Promise<Float32Array> {
  return run<Float32Array>({ id: ++lastId, kind: 'distances', from, to, most });
}
