// SPDX-License-Identifier: Apache-2.0
// What two shapes are to each other, in words and bars.
import type { Child } from '../dom';
import { h } from '../dom';
import { fitWords, percent } from '../text';
import { scoreLine, verdictLine } from './card';
import { facts } from './facts';
import { allReasons } from './reasons';
import type { Explanation, Fit, Motion, Verdict } from '../../gen/shapedb/v1/search_service_pb';
import { FitKind } from '../../gen/shapedb/v1/search_service_pb';

export interface Likeness {
  score: number;
  signatureScore: number;
  verdict: Verdict;
  verdictReliability: number;
  explanation?: Explanation | undefined;
  fit?: Fit | undefined;
}

/** How the hit has to be moved; undefined: nobody knows. */
export function motionOf(likeness: Likeness): Motion | undefined {
  return likeness.fit?.best?.motion ?? likeness.explanation?.motion;
}

export function why(likeness: Likeness): Child[] {
  const { fit, explanation } = likeness;
  return [
    h('div', { class: 'verdict-box' }, scoreLine(likeness.score),
      verdictLine(likeness)),
    fit && h('h2', {}, 'How they lie on each other'),
    fit?.best && h('p', { class: 'fit-words' }, `${fitWords(fit.best)}.`),
    fit && fitFacts(fit),
    explanation && explanation.terms.length > 0 && h('h2', {}, 'Why this score'),
    explanation && explanation.terms.length > 0 && allReasons(explanation.terms),
    h('p', { class: 'faint' }, `The signatures alone: ${likeness.signatureScore.toFixed(3)}`),
  ];
}

function fitFacts(fit: Fit): HTMLElement {
  const best = fit.best!;
  const motion = best.motion!;
  const kinds: Record<FitKind, string> = {
    [FitKind.WHOLE]: 'whole', [FitKind.ONE_SIDED]: 'seen from one side', [FitKind.PIECE]: 'a piece',
  };
  return facts([
    ['query', kinds[fit.kind]],
    ['apart', `${percent(best.residual)} of the query's size`],
    ['scaled by', motion.scale.toPrecision(4)],
    ['mirrored', fit.leftRightOpen ? 'cannot be told' : motion.reflected ? 'yes' : 'no'],
    ['other poses as good', fit.alternatives.length === 0 ? 'none' : String(fit.alternatives.length)],
    ['turns freely', fit.axes.length === 0 ? '' : `about ${fit.axes.length === 1 ? 'one axis' : 'several axes'}`],
  ]);
}
