// SPDX-License-Identifier: Apache-2.0
// Scan files become points here, in the browser: the server only ever sees points. The readers follow those of the command
// (client/io/), whose rules docs/file-formats.md has; one set of files holds them to each other
// (tests/support/file_cases/).
import type { Point, Positions } from '../cloud/cloud';
import type { Content } from './content';
import { endingOf } from './ending';
import { countText, FileFault } from './fault';
import { gunzip, isPacked } from './gunzip';
import { endingOfContent, hasTextForBinary, kKindNames } from './kind_of_content';
import { readObj } from './obj';
import { readOff } from './off';
import { readPcd } from './pcd';
import { readPly } from './ply';
import { checkNotRounded, originOf, relativeTo } from './resolution';
import { latin1, ScanBytes } from './scan_bytes';
import { readStl } from './stl';
import { sampleSurface, wantsSamples } from './surface';
import { readText } from './text';
import { inQuotes } from './words';

const kReaders: Record<string, (file: ScanBytes) => Content> = {
  ply: readPly, pcd: readPcd, off: readOff, obj: readObj, stl: readStl, xyz: readText, xyzn: readText, xyzrgb: readText,
  txt: readText, pts: readText, asc: readText, csv: readText,
};
export const kFileEndings = Object.keys(kReaders);

/** What the command reads beside these. */
const kOfTheCommand = ['las', 'gltf', 'glb', '3mf'];

const kLeastPoints = 4;

export interface Scan {
  /** Relative to the origin. */
  positions: Positions;
  /** 0, 0, 0 unless the scan lies far from there. */
  origin: Point;
  /** The file held a surface, of which these points are a sample. */
  sampled: boolean;
  /** Points left out, for the file says that nothing was measured there. */
  skipped: number;
  /** Lists of the file that may have named faces, but did not. */
  ignored: string[];
}

/** Throws a FileFault that begins with the name and says what is wrong with the file, and where. */
export function decode(name: string, bytes: ArrayBuffer): Scan {
  return named(name, () => {
    const content = contentOf(name, new Uint8Array(bytes));
    checkNotRounded(content.vertices);
    if (content.vertexCount < kLeastPoints) {
      throw new FileFault(`the file has ${countText(content.vertexCount, 'point')}; a scan has at least ${kLeastPoints}`,
        'too_few_points');
    }
    const origin = originOf(content.vertices);
    const vertices = relativeTo(content.vertices, origin);
    const sampled = wantsSamples(content);
    const positions = sampled ? sampleSurface(vertices, content.triangles) : vertices;
    return { positions, origin, sampled, skipped: content.skipped, ignored: content.ignored };
  });
}

/** What is in the file, before anything is made of it. Throws a FileFault. */
export function readContent(name: string, bytes: ArrayBuffer): Content {
  return named(name, () => {
    const content = contentOf(name, new Uint8Array(bytes));
    checkNotRounded(content.vertices);
    return content;
  });
}

function named<R>(name: string, read: () => R): R {
  try {
    return read();
  } catch (error) {
    if (error instanceof FileFault) throw new FileFault(`${name}: ${error.message}`, error.reason);
    // Never words of the language: the browser may refuse the memory of a huge file.
    if (error instanceof RangeError) throw new FileFault(`${name}: too large for this browser; use \`shapedb add\``, 'out_of_memory');
    // A fault of ours.
    throw new FileFault(`${name}: reading failed: ${(error as Error).message}`, 'internal');
  }
}

function contentOf(name: string, bytes: Uint8Array): Content {
  const read = readerOf(name);
  const unpacked = isPacked(bytes) ? gunzip(bytes) : bytes;
  try {
    checkHasContent(unpacked);
    return read(new ScanBytes(unpacked));
  } catch (error) {
    throw (error instanceof FileFault ? ofAnotherKind(read, unpacked) : undefined) ?? error;
  }
}

/** What to say in place of the reader's complaint about a file that is not what its ending or its header says. */
function ofAnotherKind(read: (file: ScanBytes) => Content, bytes: Uint8Array): FileFault | undefined {
  const ending = endingOfContent(bytes);
  if (ending === undefined) return undefined;
  if (kReaders[ending] === read) {
    return hasTextForBinary(bytes) ? new FileFault("the header announces binary data, but text follows: it should say 'ascii'") : undefined;
  }
  const expected = kFileEndings.find((one) => kReaders[one] === read)!;
  const elsewhere = kReaders[ending] === undefined ? ' (the command reads that, this page does not)' : '';
  return new FileFault(`this is ${kKindNames[ending]}, not ${kKindNames[expected]}: rename it to end in .${ending}${elsewhere}`);
}

function readerOf(name: string): (file: ScanBytes) => Content {
  const ending = endingOf(name);
  if (Object.hasOwn(kReaders, ending)) return kReaders[ending]!;
  const known = kFileEndings.map((one) => `.${one}`).join(' ');
  if (kOfTheCommand.includes(ending)) {
    throw new FileFault(`this page does not read .${ending} files, but the command does: \`shapedb query FILE\` searches with it, ` +
      `\`shapedb add FILE\` stores it. The page reads ${known}`, 'unknown_file_format');
  }
  throw new FileFault(`${ending === '' ? 'the file has no ending' : `files that end in ${inQuotes(`.${ending}`)} are not read`}; the page reads ` +
    `${known}, and .gz after that. What converts other files: docs/file-formats.md, "Other formats"`, 'unknown_file_format');
}

const kArchives: [start: string, name: string][] = [
  ['PK\x03\x04', 'ZIP archive'], ['BZh', 'file packed by bzip2'], ['\xfd7zXZ', 'file packed by xz'],
  ['\x28\xb5\x2f\xfd', 'file packed by zstd'], ['7z\xbc\xaf\x27\x1c', '7-Zip archive'],
];

/** What no reader can make anything of is named for what it is. */
function checkHasContent(bytes: Uint8Array): void {
  const kPointer = 'version https://git-lfs.github.com/spec/';
  const start = latin1(bytes.subarray(0, kPointer.length));
  if (['', '\xef\xbb\xbf', '\xff\xfe', '\xfe\xff'].includes(start)) throw new FileFault('the file is empty');
  if (start === kPointer) {
    throw new FileFault("this is a Git LFS pointer, not the file itself; fetch that with 'git lfs pull'");
  }
  const archive = kArchives.find(([signature]) => start.startsWith(signature));
  if (archive !== undefined) throw new FileFault(`this is a ${archive[1]}; unpack it first`);
}

/** What a FileFault of a file may have. */
export const kReasons = ['malformed_file', 'non_finite_coordinate', 'coordinate_out_of_range', 'too_few_points', 'unknown_file_format'];
export { FileFault };
