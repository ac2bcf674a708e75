// SPDX-License-Identifier: Apache-2.0
// The API key of this tab. It is kept until the tab is closed, and sent to nobody but the page's own server.

const kName = 'shapedb-key';

export function apiKey(): string {
  return sessionStorage.getItem(kName) ?? '';
}

/** Empty: forgets it. */
export function setApiKey(key: string): void {
  if (key === '') sessionStorage.removeItem(kName);
  else sessionStorage.setItem(kName, key);
}
