// SPDX-License-Identifier: Apache-2.0
// Wavefront OBJ: v and f lines; nothing else changes the surface. three's OBJLoader continues comments and file names that
// end in a backslash, and rounds to single precision.
import { Content, Corners } from './content';
import { countText, FileFault } from './fault';
import type { ScanBytes } from './scan_bytes';
import { inQuotes, inQuotesNotANumber, integerOf, realOf, withoutBlanksAtEnd, withoutComment, Words } from './words';

export function readObj(file: ScanBytes): Content {
  return new ObjReader(file).read();
}

class ObjReader {
  private readonly content = new Content();
  private readonly fan = new Corners(this.content);
  private greatest = { index: 0, line: 0 };

  constructor(private readonly file: ScanBytes) {}

  read(): Content {
    const { file, content } = this;
    file.decodeText();
    for (let line = file.readLine(); line !== undefined; line = file.readLine()) {
      const words = new Words(withoutComment(line));
      const keyword = words.next().toLowerCase();
      if (keyword === 'v') this.readVertex(this.continued(words));
      else if (keyword === 'f' || keyword === 'fo') this.readFace(this.continued(words));
    }
    if (this.greatest.index > content.vertexCount) throw this.missingVertex(this.greatest.line, this.greatest.index);
    if (content.vertexCount === 0) {
      throw new FileFault("no vertex (a line 'v x y z') found; this is not a Wavefront OBJ file");
    }
    return content;
  }

  /**
   * A backslash at the end of a line continues it. Only of vertices and faces: in comments and in the names of files
   * ("mtllib C:\textures\") it is a letter like any other, and the next line may be a vertex.
   */
  private continued(words: Words): Words {
    let rest = withoutBlanksAtEnd(words.rest());
    if (!rest.endsWith('\\')) return words;
    let joined = '';
    do {
      joined += `${rest.slice(0, -1)} `;
      rest = withoutBlanksAtEnd(withoutComment(this.file.readLine() ?? ''));
    } while (rest.endsWith('\\'));
    return new Words(joined + rest);
  }

  private readVertex(words: Words): void {
    // A weight or a colour may follow.
    const number = () => {
      const word = words.next();
      const value = realOf(word);
      if (value !== undefined) return value;
      throw this.file.atLine(
        `expected three numbers after 'v' for vertex ${this.content.vertexCount}, found ${inQuotesNotANumber(word)}`);
    };
    this.content.addVertex(number(), number(), number(), () => `line ${this.file.lineNumber}`);
  }

  /** Corners are "7", "7/1", "7//3" or "7/1/3"; negative ones count back from the last vertex. */
  private readFace(words: Words): void {
    this.fan.begin();
    const known = this.content.vertexCount;
    for (let corner = words.next(); corner !== ''; corner = words.next()) {
      const index = integerOf(corner.split('/', 1)[0]!);
      if (index === undefined || index === 0) {
        throw this.file.atLine(`expected vertex numbers from 1 after 'f', found ${inQuotes(corner)}`);
      }
      if (index < -known || index > 2 ** 32 - 1) throw this.missingVertex(this.file.lineNumber, index);
      const positive = index < 0 ? index + known + 1 : index;
      // Checked at the end: the vertex may come later in the file.
      if (positive > this.greatest.index) this.greatest = { index: positive, line: this.file.lineNumber };
      this.fan.add(positive - 1);
    }
  }

  private missingVertex(line: number, index: number): FileFault {
    return this.file.atLine(`a face names vertex ${index}, but the file has ` +
      `${countText(this.content.vertexCount, 'vertex', 'vertices')}, counted from 1`, line);
  }
}
