// SPDX-License-Identifier: Apache-2.0
// Scan files become points here, in the browser: the server only ever sees points.
import type { BufferGeometry, Object3D } from 'three';
import { Mesh } from 'three';
import { OBJLoader } from 'three/addons/loaders/OBJLoader.js';
import { PCDLoader } from 'three/addons/loaders/PCDLoader.js';
import { PLYLoader } from 'three/addons/loaders/PLYLoader.js';
import { STLLoader } from 'three/addons/loaders/STLLoader.js';

import type { Positions } from '../cloud/cloud';
import { joinPositions } from '../cloud/cloud';
import { readOff } from './off';
import { sampleSurface, triangleCorners } from './mesh';
import { readText } from './text';

export const kFileEndings = ['ply', 'pcd', 'obj', 'stl', 'off', 'xyz', 'txt', 'asc', 'pts', 'csv'];

export interface Scan {
  positions: Positions;
  /** The file held a surface, of which these points are a sample. */
  sampled: boolean;
  /** Points left out, for a coordinate of theirs was no number. */
  skipped: number;
}

/** Throws an Error that says what is wrong with the file. */
export function decode(name: string, bytes: ArrayBuffer): Scan {
  const raw = rawScan(name, bytes);
  const positions = raw.positions.every(Number.isFinite) ? raw.positions : onlyFinite(raw.positions);
  if (positions.length < 12) {
    throw new Error(`${name} has ${positions.length / 3} usable points; a scan has at least 4`);
  }
  return { positions, sampled: raw.sampled, skipped: (raw.positions.length - positions.length) / 3 };
}

interface RawScan {
  positions: Positions;
  sampled: boolean;
}

function rawScan(name: string, bytes: ArrayBuffer): RawScan {
  const ending = name.toLowerCase().split('.').pop() ?? '';
  try {
    switch (ending) {
      case 'ply': return fromGeometry(new PLYLoader().parse(bytes));
      case 'stl': return fromGeometry(triangleCorners(new STLLoader().parse(bytes)));
      case 'pcd': return fromGeometry(new PCDLoader().parse(bytes).geometry);
      case 'obj': return fromObject(new OBJLoader().parse(textOf(bytes)));
      case 'off': return fromGeometry(readOff(textOf(bytes)));
      case 'xyz': case 'txt': case 'asc': case 'pts': case 'csv':
        return { positions: readText(textOf(bytes)), sampled: false };
    }
  } catch (error) {
    throw new Error(`${name} cannot be read as ${ending.toUpperCase()}: ${(error as Error).message}`);
  }
  throw new Error(`${name}: this ending is not known. Read are ${kFileEndings.map((one) => `.${one}`).join(' ')}`);
}

function textOf(bytes: ArrayBuffer): string {
  return new TextDecoder().decode(bytes);
}

function fromGeometry(geometry: BufferGeometry): RawScan {
  if (geometry.index !== null && geometry.index.count >= 3) {
    return { positions: sampleSurface(geometry), sampled: true };
  }
  const attribute = geometry.getAttribute('position');
  if (attribute === undefined) throw new Error('there are no points in it');
  return { positions: new Float32Array(attribute.array), sampled: false };
}

/** All meshes of an OBJ file as one surface, or its points if it has no faces. */
function fromObject(object: Object3D): RawScan {
  const parts: { corners: Float32Array; faces: boolean }[] = [];
  object.traverse((part) => {
    const geometry = (part as Mesh).geometry;
    const corners = geometry?.getAttribute('position');
    if (corners !== undefined) {
      parts.push({ corners: new Float32Array(corners.array), faces: (part as Mesh).isMesh === true });
    }
  });
  const faces = parts.filter((part) => part.faces);
  if (faces.length === 0) return { positions: joinPositions(parts.map((part) => part.corners)), sampled: false };
  return fromGeometry(triangleCorners(joinPositions(faces.map((part) => part.corners))));
}

function onlyFinite(positions: Positions): Positions {
  const kept: number[] = [];
  for (let i = 0; i < positions.length; i += 3) {
    const point = positions.subarray(i, i + 3);
    if (point.every(Number.isFinite)) kept.push(...point);
  }
  return new Float32Array(kept);
}
