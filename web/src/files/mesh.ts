// SPDX-License-Identifier: Apache-2.0
// Surfaces become points.
import { BufferAttribute, BufferGeometry, Mesh, Vector3 } from 'three';
import { MeshSurfaceSampler } from 'three/addons/math/MeshSurfaceSampler.js';

import type { Positions } from '../cloud/cloud';

/** As the command line takes of a mesh. */
const kSamples = 20_000;
const kSeed = 1;

/** Points spread over the faces by area. The same surface gives the same points. */
export function sampleSurface(geometry: BufferGeometry): Positions {
  const sampler = new MeshSurfaceSampler(new Mesh(geometry));
  // @types/three does not know this method of three.
  (sampler as unknown as { setRandomGenerator(random: () => number): void }).setRandomGenerator(randomNumbers(kSeed));
  sampler.build();
  const positions = new Float32Array(3 * kSamples);
  const point = new Vector3();
  for (let i = 0; i < kSamples; ++i) {
    sampler.sample(point);
    point.toArray(positions, 3 * i);
  }
  return positions;
}

/** A geometry whose triangles are its corners three by three. */
export function triangleCorners(source: BufferGeometry | Float32Array): BufferGeometry {
  const corners = source instanceof Float32Array ? source : new Float32Array(source.getAttribute('position').array);
  const geometry = new BufferGeometry();
  geometry.setAttribute('position', new BufferAttribute(corners, 3));
  geometry.setIndex(new BufferAttribute(Uint32Array.from({ length: corners.length / 3 }, (_, i) => i), 1));
  return geometry;
}

/** Uniform in [0, 1) (Mulberry32, Ettinger 2017). */
function randomNumbers(seed: number): () => number {
  let state = seed;
  return () => {
    state = (state + 0x6d2b79f5) | 0;
    let t = Math.imul(state ^ (state >>> 15), 1 | state);
    t = (t + Math.imul(t ^ (t >>> 7), 61 | t)) ^ t;
    return ((t ^ (t >>> 14)) >>> 0) / 4294967296;
  };
}
