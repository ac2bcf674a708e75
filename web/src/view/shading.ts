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
const kFragment = `
  uniform sampler2D colours;
  uniform sampler2D depths;
  uniform vec2 step;
  uniform vec2 range;
  uniform float strength;
  varying vec2 at;
  // The logarithm of the distance from the eye: of the background a large one.
  float distanceAt(vec2 place) {
    float z = 2.0 * texture2D(depths, place).x - 1.0;
    return log2(2.0 * range.x * range.y / (range.y + range.x - z * (range.y - range.x)));
  }
  void main() {
    vec4 colour = texture2D(colours, at);
    if (colour.a == 0.0) discard;
    float here = distanceAt(at);
    float behind = 0.0;
    for (int i = 0; i < 8; ++i) {
      float angle = 0.785398 * float(i);
      behind += max(0.0, here - distanceAt(at + step * vec2(cos(angle), sin(angle))));
    }
    gl_FragColor = vec4(colour.rgb * max(exp(-strength * behind), 0.42), 1.0);
  }`;

export class Shading {
  private readonly target: WebGLRenderTarget;
  private readonly stage = new Stage();
  private readonly flat = new OrthographicCamera();
  private readonly material = new ShaderMaterial({
    vertexShader: kVertex, fragmentShader: kFragment, depthTest: false, depthWrite: false,
    uniforms: {
      colours: { value: null }, depths: { value: null }, step: { value: new Vector2() }, range: { value: new Vector2() },
      strength: { value: kStrength },
    },
  });

  constructor(private readonly renderer: WebGLRenderer) {
    this.target = new WebGLRenderTarget(1, 1, { minFilter: NearestFilter, magFilter: NearestFilter });
    this.target.depthTexture = new DepthTexture(1, 1, UnsignedIntType);
    const screen = new Mesh(new PlaneGeometry(2, 2), this.material);
    screen.frustumCulled = false;
    this.stage.add(screen);
  }

  /** `prepare` is called before each of `views` parts of the picture, from left to right, is drawn. */
  draw(scene: Scene, camera: PerspectiveCamera, views: number, prepare: (view: number) => void): void {
    const size = this.renderer.getDrawingBufferSize(new Vector2());
    this.target.setSize(size.x, size.y);
    this.target.scissorTest = true;
    for (let view = 0; view < views; ++view) {
      const left = Math.round((view * size.x) / views);
      this.target.viewport.set(left, 0, size.x / views, size.y);
      this.target.scissor.set(left, 0, size.x / views, size.y);
      this.renderer.setRenderTarget(this.target);
      prepare(view);
      this.renderer.render(scene, camera);
    }
    const uniforms = this.material.uniforms;
    uniforms['colours']!.value = this.target.texture;
    uniforms['depths']!.value = this.target.depthTexture;
    uniforms['step']!.value.set(kRadius, kRadius).multiplyScalar(this.renderer.getPixelRatio()).divide(size);
    uniforms['range']!.value.set(camera.near, camera.far);
    this.renderer.setRenderTarget(null);
    this.renderer.render(this.stage, this.flat);
  }

  dispose(): void {
    this.target.depthTexture?.dispose();
    this.target.dispose();
    this.material.dispose();
  }
}
