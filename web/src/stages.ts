// SPDX-License-Identifier: Apache-2.0
// The stages of the server's work, in words.

/** Told as it goes; `share` undefined: nobody knows how far it is. */
export type OnProgress = (stage: string, share?: number) => void;

/** Stages with the same words are shown as one. */
const kWords: Record<string, string> = {
  '': 'It waits for its turn',
  queued: 'It waits for its turn',
  sanitise: 'Noise is averaged, strays are dropped',
  outliers: 'Noise is averaged, strays are dropped',
  smooth: 'Noise is averaged, strays are dropped',
  thin: 'Noise is averaged, strays are dropped',
  decimate: 'Noise is averaged, strays are dropped',
  delaunay: 'Tetrahedra are laid between the points',
  point_scale: 'Inside is told from outside',
  interior: 'Inside is told from outside',
  flow: 'Parts are found',
  merge: 'Parts are found',
  segments: 'Parts are found',
  describe: 'The shape is measured',
  surface: 'Its surface is sampled',
  search: 'Shapes are scored, the best are laid on it',
};

export function stageInWords(stage: string): string {
  return kWords[stage] ?? `Stage: ${stage}`;
}

/** What the server says of its work. */
export function tellStage(onProgress: OnProgress, { stage, done, total }: { stage: string; done: bigint; total: bigint }): void {
  onProgress(stageInWords(stage), total > 0n ? Number(done) / Number(total) : undefined);
}
