// SPDX-License-Identifier: Apache-2.0
// Stage by stage, what is being done, with a bar where somebody knows how far it is.
import { h } from '../dom';
import type { OnProgress } from '../stages';

export class Progress {
  readonly element = h('ol', { class: 'stages', 'aria-live': 'polite' });
  private name = '';
  private bar: HTMLProgressElement | undefined;

  /** As OnProgress: a new stage ends the one before. */
  readonly tell: OnProgress = (stage, share) => {
    if (stage !== this.name) {
      this.done();
      this.name = stage;
      this.bar = h('progress', { 'aria-label': stage, max: 1 });
      this.element.append(h('li', { class: 'now' }, stage, this.bar));
    }
    if (share !== undefined) this.bar!.value = share;
  };

  /** All stages are. */
  done(): void {
    const last = this.element.lastElementChild;
    if (last === null) return;
    last.className = 'done';
    this.bar?.remove();
  }
}
