// SPDX-License-Identifier: Apache-2.0
// The address holds the state of the page: whatever is seen is a link. #/PAGE/COLLECTION/KEY/...?option=value

export const kPages = ['shapes', 'shape', 'like', 'compare', 'scan', 'families', 'admin'] as const;
export type PageName = (typeof kPages)[number];

export interface Address {
  page: PageName;
  /** What the address says where there is no such page; `page` is the wall then. */
  unknown?: string;
  /** Empty: none chosen yet. */
  collection: string;
  keys: string[];
  options: Record<string, string>;
}

export function parseAddress(hash: string): Address {
  const [path = '', query = ''] = splitOnce(hash.replace(/^#\/?/, ''), '?');
  const [page = '', collection = '', ...keys] = path.split('/').map(decode);
  const known = kPages.find((name) => name === page);
  if (known === undefined && page !== '') return { page: 'shapes', unknown: page, collection: '', keys: [], options: {} };
  return {
    page: known ?? 'shapes',
    collection,
    keys,
    options: Object.fromEntries(new URLSearchParams(query)),
  };
}

/** Options that are empty are left out. */
export function formatAddress(address: Address): string {
  const path = [address.page, address.collection, ...address.keys].map(encodeURIComponent).join('/');
  const set = Object.entries(address.options).filter(([, value]) => value !== '');
  return `#/${path}${set.length === 0 ? '' : `?${new URLSearchParams(set)}`}`;
}

/** The same view with some options changed. */
export function withOptions(address: Address, options: Record<string, string>): Address {
  return { ...address, options: { ...address.options, ...options } };
}

/** Another page of the same collection; `keep` names the options it takes along. */
export function linkTo(address: Address, page: PageName, keys: string[], keep: readonly string[] = []): string {
  const options = Object.fromEntries(Object.entries(address.options).filter(([name]) => keep.includes(name)));
  return formatAddress({ page, collection: address.collection, keys, options });
}

/** Where one comes from, in the order of the views: of a hit the search, of a search its shape, of a shape the wall. */
export function parentOf(address: Address): Address {
  const { page, collection, keys, options } = address;
  if (page === 'compare' && keys.length > 0) return { page: 'like', collection, keys: keys.slice(0, 1), options };
  if (page === 'scan' && keys.length > 0) return { page, collection, keys: [], options };
  if (page === 'like') return { page: 'shape', collection, keys, options: {} };
  return { page: 'shapes', collection, keys: [], options: {} };
}

export function currentAddress(): Address {
  return parseAddress(location.hash);
}

/** Shows another view; `replace`: the browser's back button does not come here again. */
export function goTo(address: Address, replace = false): void {
  const target = formatAddress(address);
  if (target === location.hash) return;
  if (!replace) {
    location.hash = target;
    return;
  }
  history.replaceState(null, '', target);
  window.dispatchEvent(new HashChangeEvent('hashchange'));
}

function splitOnce(text: string, by: string): [string, string] {
  const at = text.indexOf(by);
  return at < 0 ? [text, ''] : [text.slice(0, at), text.slice(at + by.length)];
}

function decode(text: string): string {
  try {
    return decodeURIComponent(text);
  } catch {
    return text;  // a hand-written address with a lone %
  }
}
