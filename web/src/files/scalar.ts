// SPDX-License-Identifier: Apache-2.0
// The numbers of binary PLY and PCD records.

export type ScalarType = 'i1' | 'u1' | 'i2' | 'u2' | 'i4' | 'u4' | 'i8' | 'u8' | 'f4' | 'f8';

export function scalarSize(type: ScalarType): number {
  return Number(type[1]);
}

export function isFloating(type: ScalarType): boolean {
  return type[0] === 'f';
}

/** Exact, except for 64-bit integers beyond 2^53. */
export function loadScalar(data: DataView, at: number, type: ScalarType, little: boolean): number {
  switch (type) {
    case 'i1': return data.getInt8(at);
    case 'u1': return data.getUint8(at);
    case 'i2': return data.getInt16(at, little);
    case 'u2': return data.getUint16(at, little);
    case 'i4': return data.getInt32(at, little);
    case 'u4': return data.getUint32(at, little);
    case 'i8': return Number(data.getBigInt64(at, little));
    case 'u8': return Number(data.getBigUint64(at, little));
    case 'f4': return data.getFloat32(at, little);
    case 'f8': return data.getFloat64(at, little);
  }
}
