// SPDX-License-Identifier: Apache-2.0
// What takes long runs here, so that the page stays at hand: reading files, and distances between clouds.
import { distancesTo } from './cloud/nearest';
import type { Scan } from './files/decode';
import { decode } from './files/decode';

export type Task =
  | { id: number; kind: 'decode'; name: string; bytes: ArrayBuffer }
  | { id: number; kind: 'distances'; from: Float32Array; to: Float32Array; most: number };
export type Outcome = { id: number; result: Scan | Float32Array } | { id: number; error: string };

function run(task: Task): Scan | Float32Array {
  if (task.kind === 'decode') return decode(task.name, task.bytes);
  return distancesTo(task.from, task.to, task.most);
}

addEventListener('message', (event: MessageEvent<Task>) => {
  const { id } = event.data;
  let outcome: Outcome;
  try {
    outcome = { id, result: run(event.data) };
  } catch (error) {
    outcome = { id, error: error instanceof Error ? error.message : String(error) };
  }
  postMessage(outcome);
});
