// SPDX-License-Identifier: Apache-2.0
// The place of a large picture, also where the browser has no WebGL.
import { h } from '../dom';
import { Viewer } from '../view/viewer';
import { empty } from './status';

const shownIn = new WeakMap<HTMLElement, Viewer>();

/** In place of a viewer that was there. Null: `place` says why there is no picture. */
export function viewerIn(place: HTMLElement, label: string, signal: AbortSignal): Viewer | null {
  shownIn.get(place)?.dispose();
  shownIn.delete(place);
  let viewer: Viewer;
  try {
    viewer = new Viewer(label);
  } catch {
    place.replaceChildren(empty('There is no picture', 'This browser has no WebGL 2, with which shapes are drawn.'));
    return null;
  }
  place.replaceChildren(viewer.element);
  shownIn.set(place, viewer);
  signal.addEventListener('abort', () => viewer.dispose());
  return viewer;
}

export function pictureHint(): HTMLElement {
  return h('p', { class: 'faint hint' },
    'Drag to turn, wheel or two fingers to come nearer; arrow keys, + and - do the same.');
}
