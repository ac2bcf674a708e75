// SPDX-License-Identifier: Apache-2.0
// What a search or a comparison may do, as switches; the address has them.
import type { Address } from '../address';
import { goTo, withOptions } from '../address';
import { h } from '../dom';

/** Names in the address. Absent: the switch is as the server has it by default. */
export const kSearchOptions = ['partial', 'mirror', 'size', 'verify', 'filter', 'k'] as const;

interface Switch {
  option: string;
  /** The value in the address when the switch is not as it is by default. */
  other: string;
  onByDefault: boolean;
  label: string;
  title: string;
}

const kSwitches: Switch[] = [
  { option: 'partial', other: '1', onByDefault: false, label: 'Query is a part',
    title: 'The query may be one side or a piece: how much of it does a hit contain?' },
  { option: 'mirror', other: '0', onByDefault: true, label: 'Mirror images count',
    title: 'Left and right parts are alike' },
  { option: 'size', other: '1', onByDefault: false, label: 'Same size',
    title: 'Shapes are not scaled to each other' },
  { option: 'verify', other: '0', onByDefault: true, label: 'Verified',
    title: 'The best candidates are laid on the query, point by point' },
];

export interface Choices {
  partial: boolean;
  forbidReflection: boolean;
  keepScale: boolean;
  /** Undefined: as the server does by default. */
  verify: boolean | undefined;
}

export function choicesOf(address: Address): Choices {
  return {
    partial: address.options['partial'] === '1',
    forbidReflection: address.options['mirror'] === '0',
    keepScale: address.options['size'] === '1',
    verify: address.options['verify'] === '0' ? false : undefined,
  };
}

/** `names`: which of the switches. */
export function switches(address: Address, names: readonly string[]): HTMLElement {
  return h('div', { class: 'switches' }, ...kSwitches.filter((one) => names.includes(one.option)).map((one) => {
    const on = (address.options[one.option] === one.other) !== one.onByDefault;
    const box = h('input', {
      type: 'checkbox', id: `switch-${one.option}`, checked: on,
      onchange: () => goTo(withOptions(address, {
        [one.option]: box.checked === one.onByDefault ? '' : one.other,
      }), true),
    });
    return h('label', { class: 'switch', title: one.title }, box, one.label);
  }));
}
