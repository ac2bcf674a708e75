// SPDX-License-Identifier: Apache-2.0
// Draws point clouds that can be turned by mouse, finger and keys; one camera, one or two views side by side.
import type { Matrix4 } from 'three';
import {
  Box3, BufferAttribute, BufferGeometry, LinearSRGBColorSpace, PerspectiveCamera, Points, Scene, ShaderMaterial, Spherical, Vector3,
  WebGLRenderer,
} from 'three';
import { OrbitControls } from 'three/addons/controls/OrbitControls.js';

import { spacingOf } from '../cloud/cloud';
import { h } from '../dom';
import { pointsMaterial } from './points_material';
import { Shading } from './shading';

const kFieldOfView = 35;
const kTurnByKey = 0.12;  // radians
/** Picture beyond the shapes. */
const kMargin = 1.12;
const kPointsMeasured = 4_000;
/** Points are drawn so many times as large as they are apart, which closes them to a surface. */
const kOverlap = 2.1;

/** Drawn at most of a cloud while the picture moves. */
const kPointsInMotion = 150_000;
const kRestMilliseconds = 200;

/** 0 to count - 1 in an order in which each beginning is spread over all. */
function shuffled(count: number): Uint32Array {
  const order = Uint32Array.from({ length: count }, (_, i) => i);
  for (let i = count - 1; i > 0; --i) {
    const j = Math.floor(Math.random() * (i + 1));
    [order[i], order[j]] = [order[j]!, order[i]!];
  }
  return order;
}

/** One cloud of the picture, in a frame about the origin with a diagonal of about 1. */
export interface Layer {
  /** `colours`: three bytes a point. */
  setColours(colours: Uint8Array): void;
  setMatrix(matrix: Matrix4): void;
  setVisible(visible: boolean): void;
}

export class Viewer {
  readonly element: HTMLElement;
  private readonly renderer: WebGLRenderer;
  private readonly scene = new Scene();
  private readonly camera = new PerspectiveCamera(kFieldOfView, 1, 0.05, 30);
  private readonly controls: OrbitControls;
  private readonly shading: Shading;
  private readonly layers: Points<BufferGeometry, ShaderMaterial>[] = [];
  private readonly resizes: ResizeObserver;
  private frame = 0;
  private resting: ReturnType<typeof setTimeout> | undefined;
  private moving = false;
  private split = false;

  /** `label` tells people who do not see it what is drawn. Throws where there is no WebGL. */
  constructor(label: string) {
    const canvas = h('canvas', { tabindex: 0, role: 'img', 'aria-label': label, class: 'viewer-canvas' });
    this.element = h('div', { class: 'viewer' }, canvas);
    this.renderer = new WebGLRenderer({ canvas, alpha: true, antialias: false });
    this.shading = new Shading(this.renderer);
    this.renderer.outputColorSpace = LinearSRGBColorSpace;  // colours are drawn as the palette has them
    this.renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
    this.camera.up.set(0, 0, 1);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.addEventListener('change', () => this.move());
    canvas.addEventListener('keydown', (event) => this.onKey(event));
    this.resizes = new ResizeObserver(() => this.redraw());
    this.resizes.observe(this.element);
  }

  /** `positions` are not copied. */
  addLayer(positions: Float32Array, colours: Uint8Array): Layer {
    const geometry = new BufferGeometry();
    geometry.setAttribute('position', new BufferAttribute(positions, 3));
    geometry.setAttribute('tint', new BufferAttribute(colours, 3));
    const points = new Points(geometry, pointsMaterial());
    points.matrixAutoUpdate = false;
    points.frustumCulled = false;
    points.userData['spacing'] = spacingOf(positions);
    if (positions.length / 3 > kPointsInMotion) geometry.setIndex(new BufferAttribute(shuffled(positions.length / 3), 1));
    this.scene.add(points);
    this.layers.push(points);
    this.redraw();
    return {
      setColours: (fresh) => {
        geometry.setAttribute('tint', new BufferAttribute(fresh, 3));
        this.redraw();
      },
      setMatrix: (matrix) => {
        points.matrix.copy(matrix);
        points.matrixWorldNeedsUpdate = true;
        this.redraw();
      },
      setVisible: (visible) => {
        points.visible = visible;
        this.redraw();
      },
    };
  }

  clear(): void {
    for (const layer of this.layers.splice(0)) {
      this.scene.remove(layer);
      layer.geometry.dispose();
      layer.material.dispose();
    }
    this.redraw();
  }

  /** Two views with one camera: the first layer left, the others right. Otherwise each shines through what covers it. */
  setSplit(split: boolean): void {
    this.split = split;
    this.redraw();
  }

  /** Looks from the front and above, so near that all layers are just seen. */
  look(): void {
    const back = new Vector3(0.35, -0.85, 0.45).normalize();
    const right = new Vector3().crossVectors(this.camera.up, back).normalize();
    const up = new Vector3().crossVectors(back, right);
    const box = new Box3();
    const point = new Vector3();
    for (const layer of this.layers) {
      const positions = layer.geometry.getAttribute('position');
      const step = Math.max(1, Math.floor(positions.count / kPointsMeasured));
      for (let i = 0; i < positions.count; i += step) {
        point.fromBufferAttribute(positions, i).applyMatrix4(layer.matrix);
        box.expandByPoint(new Vector3(point.dot(right), point.dot(up), point.dot(back)));
      }
    }
    if (box.isEmpty()) return;
    const size = box.getSize(new Vector3());
    const middle = box.getCenter(new Vector3());
    const tangent = Math.tan((kFieldOfView / 360) * Math.PI);
    const distance = (kMargin * Math.max(size.y, size.x / this.aspect())) / 2 / tangent + size.z / 2;
    this.controls.target.set(0, 0, 0).addScaledVector(right, middle.x).addScaledVector(up, middle.y)
      .addScaledVector(back, middle.z);
    this.camera.position.copy(this.controls.target).addScaledVector(back, distance);
    this.controls.update();
    this.redraw();
  }

  /** Draws at once, for those who look at the pixels. */
  draw(): void {
    this.frame = 0;
    const width = this.element.clientWidth;
    const height = this.element.clientHeight;
    if (width === 0 || height === 0) return;
    this.renderer.setSize(width, height, true);
    const parts = this.layers.length > 1 ? 2 : 1;
    this.camera.aspect = this.aspect();
    this.camera.updateProjectionMatrix();
    this.styleLayers(height);
    const shown = this.layers.map((layer) => layer.visible);
    this.shading.draw(this.scene, this.camera, parts, this.split, (part) => {
      this.layers.forEach((layer, i) => (layer.visible = shown[i]! && (parts === 1 || (i === 0) === (part === 0))));
    });
    this.layers.forEach((layer, i) => (layer.visible = shown[i]!));
  }

  dispose(): void {
    cancelAnimationFrame(this.frame);
    this.resizes.disconnect();
    clearTimeout(this.resting);
    this.controls.dispose();
    this.clear();
    this.shading.dispose();
    this.renderer.dispose();
    this.renderer.forceContextLoss();
  }

  private redraw(): void {
    if (this.frame === 0) this.frame = requestAnimationFrame(() => this.draw());
  }

  /** While the picture moves large clouds are drawn thinner, so that it moves smoothly. */
  private move(): void {
    const large = this.layers.some((layer) => layer.geometry.index !== null);
    this.moving = large;
    clearTimeout(this.resting);
    if (large) {
      this.resting = setTimeout(() => {
        this.moving = false;
        this.redraw();
      }, kRestMilliseconds);
    }
    this.redraw();
  }

  /** Of one view. */
  private aspect(): number {
    const { clientWidth: width, clientHeight: height } = this.element;
    return height === 0 ? 1 : width / (this.split ? 2 : 1) / height;
  }

  private styleLayers(height: number): void {
    const pixelsAtOne = (height * this.renderer.getPixelRatio()) / (2 * Math.tan((kFieldOfView / 360) * Math.PI));
    for (const layer of this.layers) {
      const { geometry } = layer;
      const count = geometry.getAttribute('position').count;
      const drawn = this.moving ? Math.min(count, kPointsInMotion) : count;
      geometry.setDrawRange(0, drawn);
      const spacing = layer.userData['spacing'] * Math.sqrt(count / drawn);
      const diameter = kOverlap * spacing * layer.matrix.getMaxScaleOnAxis();
      layer.material.uniforms['size']!.value = diameter * pixelsAtOne;
      layer.material.uniforms['radius']!.value = diameter / 2;
    }
  }

  private onKey(event: KeyboardEvent): void {
    const turn: Record<string, [number, number]> = {
      ArrowLeft: [-kTurnByKey, 0], ArrowRight: [kTurnByKey, 0], ArrowUp: [0, -kTurnByKey], ArrowDown: [0, kTurnByKey],
    };
    const zoom: Record<string, number> = { '+': 0.9, '=': 0.9, '-': 1 / 0.9 };
    const [around, down] = turn[event.key] ?? [0, 0];
    const nearer = zoom[event.key] ?? 1;
    if (around === 0 && down === 0 && nearer === 1) return;
    event.preventDefault();
    event.stopPropagation();
    // Spherical measures from the y axis, we from z.
    const offset = this.camera.position.clone().sub(this.controls.target);
    const place = new Spherical().setFromVector3(new Vector3(offset.x, offset.z, -offset.y));
    place.theta += around;
    place.phi += down;
    place.radius *= nearer;
    place.makeSafe();
    const turned = new Vector3().setFromSpherical(place);
    this.camera.position.set(turned.x, -turned.z, turned.y).add(this.controls.target);
    this.controls.update();
    this.redraw();
  }
}
