// SPDX-License-Identifier: Apache-2.0
// What a page of the page is made of.
import type { Address } from './address';

export interface View {
  /** Of the browser's window. */
  title: string;
  element: HTMLElement;
  /** Gives back what the garbage collector does not see. */
  dispose?: () => void;
}

/** Shows an address; `signal` is aborted when another view takes its place. */
export type ViewMaker = (address: Address, signal: AbortSignal) => View;
