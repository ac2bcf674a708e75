// SPDX-License-Identifier: Apache-2.0
// Makes depth seen in a cloud without normals: eye-dome lighting (Boucheny 2009). Points farther from the eye than what is
// around them on the screen are darkened, which draws outlines and hollows.
import type { PerspectiveCamera, Scene, WebGLRenderer } from 'three';
import {
  DepthTexture, Mesh, NearestFilter, OrthographicCamera, PlaneGeometry, Scene as Stage, ShaderMaterial, UnsignedIntType,
  Vector2, WebGLRenderTarget,
} from 'three';

const kStrength = 6.0;
/** Of the neighbours looked at, in pixels of the screen. */
const kRadius = 1.3;

const kVertex = `
  varying vec2 at;
  void main() {
    at = uv;
    gl_Position = vec4(position.xy, 0.0, 1.0);
  }`;
/** Of two clouds in one place the nearer one covers so much of the other, which shines through. */
const kNearer = 0.66;

const kFragment = `
  uniform sampler2D colours;
  uniform sampler2D depths;
  uniform sampler2D otherColours;
  uniform sampler2D otherDepths;
  uniform bool two;
  uniform vec2 step;
  uniform vec2 range;
  uniform float strength;
  uniform float nearer;
  varying vec2 at;
  // The logarithm of the distance from the eye: of the background a large one.
  float distanceAt(sampler2D depths, vec2 place) {
    float z = 2.0 * texture2D(depths, place).x - 1.0;
    return log2(2.0 * range.x * range.y / (range.y + range.x - z * (range.y - range.x)));
  }
  vec3 shaded(vec3 colour, sampler2D depths) {
    float here = distanceAt(depths, at);
    float behind = 0.0;
    for (int i = 0; i < 8; ++i) {
      float angle = 0.785398 * float(i);
      behind += max(0.0, here - distanceAt(depths, at + step * vec2(cos(angle), sin(angle))));
    }
    return colour * max(exp(-strength * behind), 0.42);
  }
  void main() {
    vec4 colour = texture2D(colours, at);
    vec4 other = two ? texture2D(otherColours, at) : vec4(0.0);
    if (colour.a == 0.0 && other.a == 0.0) discard;
    float share = colour.a == 0.0 ? 0.0 : 1.0;
    if (colour.a > 0.0 && other.a > 0.0) {
      share = texture2D(depths, at).x < texture2D(otherDepths, at).x ? nearer : 1.0 - nearer;
    }
    vec3 seen = share > 0.0 ? share * shaded(colour.rgb, depths) : vec3(0.0);
    if (share < 1.0) seen += (1.0 - share) * shaded(other.rgb, otherDepths);
    gl_FragColor = vec4(seen, 1.0);
  }`;

function newTarget(): WebGLRenderTarget {
  const target = new WebGLRenderTarget(1, 1, { minFilter: NearestFilter, magFilter: NearestFilter });
  target.depthTexture = new DepthTexture(1, 1, UnsignedIntType);
  target.scissorTest = true;
  return target;
}

export class Shading {
  private readonly targets = [newTarget(), newTarget()] as const;
  private readonly stage = new Stage();
  private readonly flat = new OrthographicCamera();
  private readonly material = new ShaderMaterial({
    vertexShader: kVertex, fragmentShader: kFragment, depthTest: false, depthWrite: false,
    uniforms: {
      colours: { value: null }, depths: { value: null }, otherColours: { value: null }, otherDepths: { value: null },
      two: { value: false }, nearer: { value: kNearer }, step: { value: new Vector2() }, range: { value: new Vector2() },
      strength: { value: kStrength },
    },
  });

  constructor(private readonly renderer: WebGLRenderer) {
    const screen = new Mesh(new PlaneGeometry(2, 2), this.material);
    screen.frustumCulled = false;
    this.stage.add(screen);
  }

  /**
   * `prepare` is called before each of `parts` (at most two) is drawn. `beside`: they stand from left to right; otherwise
   * they lie on each other, and each shines through the other.
   */
  draw(scene: Scene, camera: PerspectiveCamera, parts: number, beside: boolean, prepare: (part: number) => void): void {
    const size = this.renderer.getDrawingBufferSize(new Vector2());
    const views = beside ? parts : 1;
    for (let part = 0; part < parts; ++part) {
      const target = this.targets[beside || part === 0 ? 0 : 1];
      target.setSize(size.x, size.y);
      const left = beside ? Math.round((part * size.x) / views) : 0;
      target.viewport.set(left, 0, size.x / views, size.y);
      target.scissor.set(left, 0, size.x / views, size.y);
      this.renderer.setRenderTarget(target);
      prepare(part);
      this.renderer.render(scene, camera);
    }
    const uniforms = this.material.uniforms;
    const [first, second] = this.targets;
    uniforms['colours']!.value = first.texture;
    uniforms['depths']!.value = first.depthTexture;
    uniforms['otherColours']!.value = second.texture;
    uniforms['otherDepths']!.value = second.depthTexture;
    uniforms['two']!.value = parts > 1 && !beside;
    uniforms['step']!.value.set(kRadius, kRadius).multiplyScalar(this.renderer.getPixelRatio()).divide(size);
    uniforms['range']!.value.set(camera.near, camera.far);
    this.renderer.setRenderTarget(null);
    this.renderer.render(this.stage, this.flat);
  }

  dispose(): void {
    for (const target of this.targets) {
      target.depthTexture?.dispose();
      target.dispose();
    }
    this.material.dispose();
  }
}
