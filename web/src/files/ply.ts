// SPDX-License-Identifier: Apache-2.0
// PLY: ASCII and both binary byte orders, any elements and properties in any order. three's PLYLoader takes part of a file
// for the whole, does not know faces under other names, and rounds to single precision.
import { Content, Corners } from './content';
import { FaceGuess } from './face_guess';
import { countText, FileFault } from './fault';
import type { PlyElement, PlyHeader, PlyProperty } from './ply_header';
import { fixedSize, readPlyHeader } from './ply_header';
import type { PlyRecord } from './ply_record';
import { BinaryRecord, recordName, TextRecord } from './ply_record';
import { isFloating, loadScalar, scalarSize } from './scalar';
import { noRoom } from './scan_bytes';
import type { ScanBytes } from './scan_bytes';
import { WordReader } from './word_reader';

const kAxes = ['x', 'y', 'z'];
const kFaces = ['face', 'faces', 'polygon', 'polygons', 'triangle', 'triangles'];

export function readPly(file: ScanBytes): Content {
  return new PlyBody(file, readPlyHeader(file)).read();
}

/** Where x, y and z are. A name in capitals counts if there is none in lower case. */
function coordinatesOf(vertex: PlyElement): number[] {
  return kAxes.map((axis) => {
    for (const name of [axis, axis.toUpperCase()]) {
      const at = vertex.properties.flatMap((one, i) => (one.name === name ? [i] : []));
      if (at.length > 1 || at.some((i) => vertex.properties[i]!.countType !== undefined)) {
        throw new FileFault(`header: element vertex needs one number '${name}', not a list or two of them`);
      }
      if (at.length === 1) return at[0]!;
    }
    throw new FileFault(`header: element vertex has no property '${axis}'`);
  });
}

interface Indices {
  /** The list that names the corners of faces or strips; -1: none. */
  at: number;
  /** It does if every entry could. */
  guessed: boolean;
}

/**
 * Passing over faces in silence would take a mesh for a few points, so the only
 * list of integers of a face counts under any name, and a face without any list of integers is an error.
 */
function indicesOf(element: PlyElement): Indices {
  // A grid names the vertex at each place, of which there is one or none.
  if (element.name === 'vertex' || element.name === 'range_grid') return { at: -1, guessed: false };
  const lists = element.properties.map((one, at) => ({ ...one, at })).filter((one) => one.countType !== undefined);
  const named = lists.filter((one) => /^vertex_(indices|index)$/i.test(one.name)).at(-1);
  if (named !== undefined) {
    if (!isFloating(named.type)) return { at: named.at, guessed: false };
    throw new FileFault(`header: the indices of element ${element.name} must be integers, not float or double`);
  }
  const whole = lists.filter((one) => !isFloating(one.type));
  const face = kFaces.includes(element.name) || element.name === 'tristrips';
  if (element.count === 0 || (!face && whole.length !== 1)) return { at: -1, guessed: false };
  if (whole.length === 1) return { at: whole[0]!.at, guessed: !face };
  throw new FileFault(`header: element ${element.name} needs a list vertex_indices, which names its corners` +
    (whole.length > 1 ? '; it has several lists under other names' : ''));
}

class PlyBody {
  private readonly content = new Content();
  private readonly words: WordReader;
  private readonly coordinates: number[];
  private readonly vertexCount: number;
  private wordByWord = false;

  constructor(private readonly file: ScanBytes, private readonly header: PlyHeader) {
    const vertices = header.elements.filter((one) => one.name === 'vertex');
    if (vertices.length > 1) throw new FileFault('header: element vertex appears twice');
    if (vertices.length === 0) throw new FileFault('header: there is no element vertex');
    this.coordinates = coordinatesOf(vertices[0]!);
    this.vertexCount = vertices[0]!.count;
    this.words = new WordReader(file, ['comment', 'obj_info']);
  }

  read(): Content {
    const { file, header, words } = this;
    // An element without properties has no body, whatever its count says.
    const elements = header.elements.filter((one) => one.properties.length > 0);
    if (this.isText) this.wordByWord = words.hasFewerLinesThan(elements.reduce((sum, one) => sum + one.count, 0));
    else file.beginBinary();
    const guesses: FaceGuess[] = [];
    for (const element of elements) {
      const indices = indicesOf(element);
      if (indices.guessed) {
        guesses.push(new FaceGuess(`list ${element.properties[indices.at]!.name} of element ${element.name}`, this.vertexCount));
      }
      this.readElement(element, indices.at, indices.guessed ? guesses.at(-1) : undefined);
    }
    this.settle(guesses);
    const after = 'data after the last element; the header announces too few';
    if (this.isText && words.next() !== '') throw file.atLine(after);
    if (!this.isText && !file.onlyPaddingLeft()) throw file.atByte(file.offset, after);
    return this.content;
  }

  private get isText(): boolean { return this.header.encoding === 'ascii'; }
  private get little(): boolean { return this.header.encoding === 'binary_little_endian'; }

  /** Faces under unknown names, if there are no others. */
  private settle(guesses: FaceGuess[]): void {
    const hasFaces = this.content.triangleCount > 0;
    for (const guess of guesses) {
      if (hasFaces || !guess.good) this.content.ignored.push(guess.name);
      else guess.moveTo(this.content);
    }
  }

  private readElement(element: PlyElement, indices: number, guess?: FaceGuess): void {
    const size = this.isText ? undefined : fixedSize(element);
    if (size === undefined) {
      const record = this.isText ? new TextRecord(this.file, this.words, this.wordByWord) : new BinaryRecord(this.file, this.little);
      if (element.name === 'vertex') this.readVertices(record, element);
      else this.readRecords(record, element, indices, guess);
      return;
    }
    const room = Math.floor(this.file.remaining / size);
    if (element.count > room) {
      throw this.file.atByte(this.file.offset, noRoom(element.count, `${element.name} record`, size, room));
    }
    if (element.name === 'vertex') this.readFixedVertices(element, size);
    else this.file.offset += element.count * size;
  }

  private readFixedVertices(element: PlyElement, size: number): void {
    const { file, little } = this;
    const data = file.data;
    const types = this.coordinates.map((at) => element.properties[at]!.type);
    const offsets = this.coordinates.map((at) => element.properties.slice(0, at).reduce((sum, one) => sum + scalarSize(one.type), 0));
    for (let i = 0; i < element.count; ++i, file.offset += size) {
      const load = (axis: number) => loadScalar(data, file.offset + offsets[axis]!, types[axis]!, little);
      this.content.addVertex(load(0), load(1), load(2), () => `byte ${file.offset}`);
    }
  }

  private readVertices(record: PlyRecord, element: PlyElement): void {
    const point = [0, 0, 0];
    for (let i = 0; i < element.count; ++i) {
      if (!record.begin()) throw record.fault(element, i, '');
      element.properties.forEach((property, j) => {
        const axis = this.coordinates.indexOf(j);
        if (axis < 0) {
          skipProperty(record, element, i, property);
          return;
        }
        const value = record.real(property.type);
        if (value === undefined) throw record.fault(element, i, `the number ${property.name}`);
        point[axis] = value;
      });
      if (!record.end()) throw record.fault(element, i, 'the line end after the last value');
      this.content.addVertex(point[0]!, point[1]!, point[2]!, () => record.where());
    }
  }

  private readRecords(record: PlyRecord, element: PlyElement, indices: number, guess?: FaceGuess): void {
    const strips = element.name === 'tristrips';
    const corners = new Corners(this.content, strips);
    for (let i = 0; i < element.count; ++i) {
      if (!record.begin()) throw record.fault(element, i, '');
      element.properties.forEach((property, j) => {
        if (j !== indices) skipProperty(record, element, i, property);
        else if (guess !== undefined) this.readGuess(record, element, i, property, guess);
        else this.readIndices(record, element, i, property, corners, strips);
      });
      if (!record.end()) throw record.fault(element, i, 'the line end after the last value');
    }
  }

  private readGuess(record: PlyRecord, element: PlyElement, index: number, property: PlyProperty, guess: FaceGuess): void {
    const length = lengthOf(record, element, index, property);
    guess.begin(length);
    for (let i = 0; i < length; ++i) guess.add(entryOf(record, element, index, property, i));
    guess.end();
  }

  private readIndices(
    record: PlyRecord, element: PlyElement, index: number, property: PlyProperty, corners: Corners, strips: boolean,
  ): void {
    const length = lengthOf(record, element, index, property);
    corners.begin();
    for (let i = 0; i < length; ++i) {
      const vertex = entryOf(record, element, index, property, i);
      if (vertex === -1 && strips) {
        // It ends a strip and starts the next one in the same list.
        corners.begin();
        continue;
      }
      if (vertex < 0 || vertex >= this.vertexCount || vertex >= 2 ** 32) {
        throw new FileFault(`${record.where()}: ${recordName(element, index)} names vertex ${vertex}, but the file has ` +
          `${countText(this.vertexCount, 'vertex', 'vertices')}, counted from 0`);
      }
      corners.add(vertex);
    }
  }
}

function lengthOf(record: PlyRecord, element: PlyElement, index: number, property: PlyProperty): number {
  const length = record.integer(property.countType!);
  if (length === undefined) throw record.fault(element, index, `the length of list ${property.name}`);
  if (length < 0) throw new FileFault(`${record.where()}: ${recordName(element, index)} has a list of negative length`);
  return length;
}

function entryOf(record: PlyRecord, element: PlyElement, index: number, property: PlyProperty, entry: number): number {
  const value = record.integer(property.type);
  if (value === undefined) throw record.fault(element, index, `entry ${entry} of ${property.name}`);
  return value;
}

function skipProperty(record: PlyRecord, element: PlyElement, index: number, property: PlyProperty): void {
  const length = property.countType === undefined ? 1 : lengthOf(record, element, index, property);
  if (!record.skip(property.type, length)) throw record.fault(element, index, property.name);
}
