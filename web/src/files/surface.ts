// SPDX-License-Identifier: Apache-2.0
// Surfaces become points, by the rule of the command (docs/file-formats.md, "Points or surface").
import { BufferAttribute, BufferGeometry, Mesh, Vector3 } from 'three';
import { MeshSurfaceSampler } from 'three/addons/math/MeshSurfaceSampler.js';

import type { Positions } from '../cloud/cloud';
import type { Content } from './content';

/** As the command line takes of a mesh. */
const kSamples = 20_000;
const kSeed = 1;

/** Share of the area that must be in small triangles, and how small: times the mean spacing of samples. */
const kDenseAreaShare = 0.99;
const kDenseEdge = 3;

/** Whether the surface is to be sampled, for its vertices are not what was measured. */
export function wantsSamples(content: Content): boolean {
  return content.triangleCount > 0 && !mostVerticesAreLoose(content) && !verticesServeBetter(content);
}

function mostVerticesAreLoose(content: Content): boolean {
  const used = new Uint8Array(content.vertexCount);
  for (const vertex of content.triangles) used[vertex] = 1;
  return 2 * used.reduce((sum, one) => sum + one, 0) < content.vertexCount;
}

/** Where the triangles have no area, or are nowhere larger than the spacing of samples. */
function verticesServeBetter(content: Content): boolean {
  const { areas, edges } = sizesOf(content);
  const area = areas.reduce((sum, one) => sum + one, 0);
  if (!(area > 0) || !Number.isFinite(area)) return true;
  if (content.vertexCount < kSamples) return false;
  const greatest = (kDenseEdge * kDenseEdge * area) / kSamples;
  const dense = areas.reduce((sum, one, i) => (edges[i]! <= greatest ? sum + one : sum), 0);
  return dense >= kDenseAreaShare * area;
}

/** Of each triangle, with the square of its longest edge. */
function sizesOf({ vertices, triangles, triangleCount }: Content): { areas: Float64Array; edges: Float64Array } {
  const areas = new Float64Array(triangleCount);
  const edges = new Float64Array(triangleCount);
  for (let i = 0; i < triangleCount; ++i) {
    const [a, b, c] = [3 * triangles[3 * i]!, 3 * triangles[3 * i + 1]!, 3 * triangles[3 * i + 2]!];
    const [ux, uy, uz] = [0, 1, 2].map((axis) => vertices[b + axis]! - vertices[a + axis]!) as [number, number, number];
    const [vx, vy, vz] = [0, 1, 2].map((axis) => vertices[c + axis]! - vertices[a + axis]!) as [number, number, number];
    areas[i] = 0.5 * Math.hypot(uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx);
    edges[i] = Math.max(squared(ux, uy, uz), squared(vx, vy, vz), squared(vx - ux, vy - uy, vz - uz));
  }
  return { areas, edges };
}

function squared(x: number, y: number, z: number): number {
  return x * x + y * y + z * z;
}

/** Points spread over the faces by area. The same surface gives the same points. */
export function sampleSurface(vertices: Positions, triangles: Uint32Array): Positions {
  const geometry = new BufferGeometry();
  geometry.setAttribute('position', new BufferAttribute(vertices, 3));
  geometry.setIndex(new BufferAttribute(triangles, 1));
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
