// SPDX-License-Identifier: Apache-2.0
import type { Content } from './content';
import { Corners } from './content';

/** Longer lists are groups of points. */
const kMostCorners = 64;

/**
 * Whether the only list of integers of an unknown element of a PLY file names corners of faces: collects triangles while
 * every list names three vertices or more, each once.
 */
export class FaceGuess {
  good = true;
  private corners: number[] = [];
  private readonly triangles: number[] = [];

  /** `name`: for people. */
  constructor(readonly name: string, private readonly vertexCount: number) {}

  /** A list of so many entries. */
  begin(length: number): void {
    this.corners = [];
    if (length < 3 || length > kMostCorners) this.good = false;
  }

  add(vertex: number): void {
    if (!this.good) return;
    if (vertex < 0 || vertex >= this.vertexCount || this.corners.includes(vertex)) this.good = false;
    else this.corners.push(vertex);
  }

  end(): void {
    if (!this.good) return;
    const fan = new Corners({ addTriangle: (...corners) => this.triangles.push(...corners) });
    fan.begin();
    for (const corner of this.corners) fan.add(corner);
  }

  moveTo(content: Content): void {
    const { triangles } = this;
    for (let i = 0; i < triangles.length; i += 3) content.addTriangle(triangles[i]!, triangles[i + 1]!, triangles[i + 2]!);
  }
}
