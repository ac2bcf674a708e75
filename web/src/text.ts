// SPDX-License-Identifier: Apache-2.0
// Numbers and values of the API in words.
import { ShapeState } from '../gen/shapedb/v1/types_pb';
import type { Fit, FitPose } from '../gen/shapedb/v1/search_service_pb';
import { Verdict } from '../gen/shapedb/v1/search_service_pb';

const kCount = new Intl.NumberFormat('en');

export function count(value: bigint | number): string {
  return kCount.format(value);
}

/** "1 shape", "2 shapes". */
export function counted(value: bigint | number, one: string, many = `${one}s`): string {
  return `${count(value)} ${BigInt(value) === 1n ? one : many}`;
}

export function percent(share: number): string {
  const value = 100 * share;
  return `${value !== 0 && Math.abs(value) < 10 ? value.toPrecision(2) : Math.round(value)} %`;
}

export function score(value: number): string {
  return value.toFixed(3);
}

export function seconds(value: number): string {
  if (value < 1) return `${Math.round(1000 * value)} ms`;
  if (value < 120) return `${value.toPrecision(3)} s`;
  return value < 7200 ? `${Math.round(value / 60)} min` : `${Math.round(value / 3600)} h`;
}

export function bytes(value: bigint | number): string {
  const units = ['B', 'KiB', 'MiB', 'GiB', 'TiB'];
  let size = Number(value);
  let unit = 0;
  while (size >= 1024 && unit < units.length - 1) {
    size /= 1024;
    ++unit;
  }
  return `${unit === 0 ? size : size.toPrecision(3)} ${units[unit]}`;
}

export function moment(time: { seconds: bigint } | undefined): string {
  if (time === undefined) return '';
  return new Date(Number(time.seconds) * 1000).toLocaleString('en', { dateStyle: 'medium', timeStyle: 'short' });
}

export function stateName(state: ShapeState): string {
  switch (state) {
    case ShapeState.PENDING: return 'waiting';
    case ShapeState.READY: return 'ready';
    case ShapeState.FAILED: return 'failed';
    case ShapeState.UNSPECIFIED: return 'unknown';
  }
}

/** Whether the shape lies on the query only as a mirror image; undefined: it was not laid on it. */
export function fitsMirrored(fit: Fit | undefined): boolean | undefined {
  return fit === undefined ? undefined : fit.best?.motion?.reflected === true && !fit.leftRightOpen;
}

/** What the hit is to the query, of mirrored twins "same object, mirrored"; empty: not verified. */
export function likeness(verdict: Verdict, fit: Fit | undefined, part = 'the query is a piece of it'): string {
  const name = verdictName(verdict, part);
  // Of different objects neither is the mirror image of the other.
  const different = verdict === Verdict.SAME_KIND || verdict === Verdict.UNRELATED;
  return fitsMirrored(fit) && !different ? [name, 'mirrored'].filter(Boolean).join(', ') : name;
}

/** How the two lie on each other, as the command says it. */
export function fitWords({ explainedQuery, explainedOther }: FitPose, query = 'the query', hit = 'the hit'): string {
  return `${percent(explainedQuery)} of ${query} lies on ${hit}, ${percent(explainedOther)} of what ${query} should show of it is there`;
}

function verdictName(verdict: Verdict, part: string): string {
  switch (verdict) {
    case Verdict.SAME_OBJECT: return 'same object';
    case Verdict.SAME_OBJECT_BENT: return 'same object, bent';
    case Verdict.PART: return part;
    case Verdict.SAME_KIND: return 'same kind';
    case Verdict.UNRELATED: return 'unrelated';
    case Verdict.UNSPECIFIED: return '';
  }
}

/** For the style sheet. */
export function verdictClass(verdict: Verdict): string {
  switch (verdict) {
    case Verdict.SAME_OBJECT:
    case Verdict.SAME_OBJECT_BENT:
    case Verdict.PART: return 'same';
    case Verdict.SAME_KIND: return 'kind';
    case Verdict.UNRELATED: return 'other';
    case Verdict.UNSPECIFIED: return 'none';
  }
}
