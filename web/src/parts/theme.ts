// SPDX-License-Identifier: Apache-2.0
// Light or dark: as the system has it, until somebody chooses.
import { h } from '../dom';

const kName = 'shapedb-theme';

export function applyTheme(): void {
  const chosen = localStorage.getItem(kName);
  if (chosen === 'light' || chosen === 'dark') document.documentElement.dataset['theme'] = chosen;
}

export function themeButton(): HTMLElement {
  const dark = () => (document.documentElement.dataset['theme'] ??
    (matchMedia('(prefers-color-scheme: dark)').matches ? 'dark' : 'light')) === 'dark';
  const toggle = () => {
    localStorage.setItem(kName, dark() ? 'light' : 'dark');
    applyTheme();
  };
  return h('button', { type: 'button', class: 'icon', title: 'Light or dark', 'aria-label': 'Light or dark', onclick: toggle }, '◐');
}
