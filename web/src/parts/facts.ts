// SPDX-License-Identifier: Apache-2.0
// Names and values in two columns.
import type { Child } from '../dom';
import { h } from '../dom';

export function facts(rows: [string, Child][]): HTMLElement {
  return h('dl', { class: 'facts' }, ...rows.filter(([, value]) => value !== '' && value !== undefined && value !== null)
    .flatMap(([name, value]) => [h('dt', {}, name), h('dd', {}, value)]));
}
