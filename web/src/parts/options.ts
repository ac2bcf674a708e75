// SPDX-License-Identifier: Apache-2.0
// What a search or a comparison may do, as switches; the address has them.
import type { Address } from '../address';
import { goTo, withOptions } from '../address';
import { call } from '../api/connect';
import { h } from '../dom';
import type { Collection } from '../../gen/shapedb/v1/collection_service_pb';
import { CollectionService } from '../../gen/shapedb/v1/collection_service_pb';
import { LengthUnit } from '../../gen/shapedb/v1/types_pb';

/** Names in the address. Absent: the switch is as the server has it by default. */
export const kSearchOptions = ['partial', 'mirror', 'size', 'verify', 'filter', 'k'] as const;

interface Switch {
  option: string;
  onByDefault: boolean;
  label: string;
  title: string;
}

const kSwitches: Switch[] = [
  { option: 'partial', onByDefault: false, label: 'Query is a part',
    title: 'The query may be one side or a piece: how much of it does a hit contain?' },
  { option: 'mirror', onByDefault: true, label: 'Mirror images count',
    title: 'Left and right parts are alike' },
  // In a collection with a unit it is on by default.
  { option: 'size', onByDefault: false, label: 'Same size',
    title: 'Shapes are not scaled to each other' },
  { option: 'verify', onByDefault: true, label: 'Verified',
    title: 'The best candidates are laid on the query, point by point' },
];

export interface Choices {
  partial: boolean;
  forbidReflection: boolean;
  keepScale: boolean;
  /** Although the collection has a unit. */
  freeScale: boolean;
  /** Undefined: as the server does by default. */
  verify: boolean | undefined;
}

export function choicesOf(address: Address): Choices {
  return {
    partial: address.options['partial'] === '1',
    forbidReflection: address.options['mirror'] === '0',
    keepScale: address.options['size'] === '1',
    freeScale: address.options['size'] === '0',
    verify: address.options['verify'] === '0' ? false : undefined,
  };
}

/** Whether sizes count in a search that does not say so. */
export function sizesCount({ signature }: Pick<Collection, 'signature'>): boolean {
  return (signature?.unit ?? LengthUnit.UNSPECIFIED) > LengthUnit.NONE;
}

/** `names`: which of the switches. */
export function switches(address: Address, names: readonly string[], signal: AbortSignal): HTMLElement {
  return h('div', { class: 'switches' }, ...kSwitches.filter((one) => names.includes(one.option)).map((one) => {
    let byDefault = one.onByDefault;
    const said = address.options[one.option];
    const isOn = () => said === '1' || (byDefault && said !== '0');
    const box = h('input', {
      type: 'checkbox', id: `switch-${one.option}`, checked: isOn(),
      onchange: () => goTo(withOptions(address, { [one.option]: box.checked === byDefault ? '' : box.checked ? '1' : '0' }), true),
    });
    const label = h('label', { class: 'switch', title: one.title }, box, one.label);
    if (one.option === 'size') {
      label.setAttribute('aria-busy', 'true');
      void call(CollectionService.method.getCollection, { name: address.collection }, { signal })
        .then((collection) => {
          byDefault = sizesCount(collection);
          box.checked = isOn();
        })
        .catch(() => undefined)  // the search tells that there is no such collection
        .finally(() => label.removeAttribute('aria-busy'));
    }
    return label;
  }));
}
