# SPDX-License-Identifier: Apache-2.0
"""Wavefront OBJ: v and f lines; nothing else changes the surface."""

from __future__ import annotations

import re
from typing import List

from ._errors import InvalidInput
from ._scan_bytes import ScanBytes
from ._scan_content import Content
from ._scan_words import (BLANKS, count_text, in_quotes, in_quotes_not_a_number, integer_of, malformed, real_of, without_comment,
                          words_of)

_KEYWORD = re.compile(r"[ \t\r\v\f]*([^ \t\r\v\f]+)")
_MOST_VERTICES = (1 << 32) - 1


def read_obj(file: ScanBytes) -> Content:
    return _Reader(file).read()


class _Reader:
    def __init__(self, file: ScanBytes) -> None:
        self._file = file
        self._content = Content()
        self._greatest = 0
        self._greatest_line = 0

    def read(self) -> Content:
        self._file.decode_text()
        line = self._file.read_line()
        while line is not None:
            content = without_comment(line)
            match = _KEYWORD.match(content)
            kind = match[1].lower() if match else ""
            if kind == "v":
                self._read_vertex(self._continued(content))
            elif kind in ("f", "fo"):
                self._read_face(self._continued(content))
            line = self._file.read_line()
        if self._greatest > self._content.vertex_count:
            raise self._missing_vertex(self._greatest_line, self._greatest)
        if not self._content.vertex_count:
            raise malformed("no vertex (a line 'v x y z') found; this is not a Wavefront OBJ file")
        return self._content

    def _continued(self, content: str) -> List[str]:
        """The words after the keyword. A backslash at the end of a line continues it. Only of vertices and faces: in
        comments and in the names of files ("mtllib C:\\textures\\") it is a letter like any other, and the next line may be
        a vertex."""
        content = content.rstrip(BLANKS)
        if content.endswith("\\"):
            pieces = []
            while content.endswith("\\"):
                pieces.append(content[:-1])
                content = without_comment(self._file.read_line() or "").rstrip(BLANKS)
            content = " ".join([*pieces, content])
        return words_of(content)[1:]

    def _read_vertex(self, words: List[str]) -> None:
        # A weight or a colour may follow.
        point = []
        for i in range(3):
            word = words[i] if i < len(words) else ""
            value = real_of(word)
            if value is None:
                raise self._file.at_line(f"expected three numbers after 'v' for vertex {self._content.vertex_count}, "
                                         f"found {in_quotes_not_a_number(word)}")
            point.append(value)
        self._content.add_vertex(point[0], point[1], point[2], lambda: f"line {self._file.line_number}")

    def _read_face(self, words: List[str]) -> None:
        """Corners are "7", "7/1", "7//3" or "7/1/3"; negative ones count back from the last vertex."""
        known = self._content.vertex_count
        corners = []
        for word in words:
            index = integer_of(word.split("/", 1)[0])
            if not index:
                raise self._file.at_line(f"expected vertex numbers from 1 after 'f', found {in_quotes(word)}")
            if not -known <= index <= _MOST_VERTICES:
                raise self._missing_vertex(self._file.line_number, index)
            if index < 0:
                index += known + 1
            # Checked at the end: the vertex may come later in the file.
            if index > self._greatest:
                self._greatest, self._greatest_line = index, self._file.line_number
            corners.append(index - 1)
        self._content.add_fan(corners)

    def _missing_vertex(self, line: int, index: int) -> InvalidInput:
        return self._file.at_line(f"a face names vertex {index}, but the file has "
                                  f"{count_text(self._content.vertex_count, 'vertex', 'vertices')}, counted from 1", line)
