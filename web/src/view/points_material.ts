// SPDX-License-Identifier: Apache-2.0
// How points look: round, and as large on the screen as their distance from each other.
import { ShaderMaterial } from 'three';

const kVertex = `
  attribute vec3 tint;
  uniform float size;
  uniform float radius;
  varying vec3 vTint;
  varying vec2 vDepth;
  varying float vRadius;
  varying float vSeen;
  void main() {
    vec4 seen = modelViewMatrix * vec4(position, 1.0);
    vTint = tint / 255.0;
    gl_PointSize = clamp(size / -seen.z, 1.5, 40.0);
    gl_Position = projectionMatrix * seen;
    vDepth = vec2(projectionMatrix[2][2], projectionMatrix[3][2]);
    vRadius = radius;
    vSeen = seen.z;
  }`;
const kFragment = `
  varying vec3 vTint;
  varying vec2 vDepth;
  varying float vRadius;
  varying float vSeen;
  void main() {
    vec2 from = 2.0 * gl_PointCoord - 1.0;
    float rim = dot(from, from);
    if (rim > 1.0) discard;
    // Bulges towards the eye: of points that overlap the one is seen whose centre is nearer.
    float z = vSeen + 0.6 * vRadius * (1.0 - rim);
    gl_FragDepth = 0.5 + 0.5 * (vDepth.x * z + vDepth.y) / -z;
    gl_FragColor = vec4(vTint, 1.0);
  }`;

export function pointsMaterial(): ShaderMaterial {
  return new ShaderMaterial({ vertexShader: kVertex, fragmentShader: kFragment, uniforms: { size: { value: 1 }, radius: { value: 0.01 } } });
}
