# SPDX-License-Identifier: Apache-2.0
"""Plain text: three numbers at the start of each line, or in the columns that a header names x, y and z."""

from __future__ import annotations

import re
from typing import List, NamedTuple, Optional

from ._scan_bytes import ScanBytes
from ._scan_content import Content
from ._scan_words import BLANKS, count_of, count_text, in_quotes_not_a_number, malformed, real_of

# A column and what separates it from the next: blanks, or one comma or semicolon with blanks around it.
_COLUMN = re.compile(r"[ \t\r\v\f]*([^ \t\r\v\f,;]*)[ \t\r\v\f]*[,;]?")
_INNER_COMMA = re.compile(r"[^ \t\r\v\f,;],[^ \t\r\v\f,;]")
_OTHER_SEPARATOR = re.compile(r";|[^ \t\r\v\f,;][ \t\r\v\f]+[^ \t\r\v\f,]")
# The signs with which comments begin in one program or another.
_COMMENT = re.compile(r"[#;%!]|//")
_END_OF_NAME = re.compile(r"[\[( ]")


def read_text_points(file: ScanBytes) -> Content:
    return _Reader(file).read()


def begins_with_a_point(data: bytes) -> bool:
    """The first line of content, after a count or column names, is a point: tells scans from notes."""
    file = ScanBytes(data)
    return _Reader(file).begins_with_a_point()


def _columns(line: str) -> List[str]:
    words = _COLUMN.findall(line)
    # The pattern matches the empty end of the line too.
    return words[:-1] if words else words


def _has_decimal_commas(line: str) -> bool:
    """Read as a separator, "1,5 2,5 3,5" would silently become the point (1, 5, 2). So where blanks or semicolons part the
    columns, commas must not stand inside them."""
    return _INNER_COMMA.search(line) is not None and _OTHER_SEPARATOR.search(line) is not None


class _Columns(NamedTuple):
    at: List[int]
    """Of x, y and z, counted from 0."""
    named: int
    """In the header."""


def _without_quotes(word: str) -> str:
    """Tables may have quotes around names and numbers."""
    return word[1:-1] if len(word) > 1 and word[0] == word[-1] == '"' else word


def _column_names(line: str) -> Optional[_Columns]:
    """A line that names the columns, x, y and z among them. "X [m]" and "x(mm)" are "x"."""
    # "X [m], Y [m]": names may have blanks if something else stands between them.
    if "," in line or ";" in line:
        words = re.split("[,;]", line[:-1] if line[-1] in ",;" else line)
    else:
        words = _columns(line)
    names = [_END_OF_NAME.split(_without_quotes(word.strip(BLANKS)), maxsplit=1)[0].lower() for word in words]
    if not {"x", "y", "z"} <= set(names):
        return None
    return _Columns([names.index(axis) for axis in "xyz"], len(names))


class _Reader:
    def __init__(self, file: ScanBytes) -> None:
        self._file = file
        file.decode_text()
        self._content = Content()
        self._at = [0, 1, 2]
        self._commented: Optional[_Columns] = None
        """What a comment before the first point names."""
        self._announced: Optional[int] = None
        self._begins = True

    def read(self) -> Content:
        line = self._next_point_line()
        while line is not None:
            self._add_point(line)
            self._add_regular_rows()
            line = self._next_point_line()
        points = self._content.vertex_count
        if self._announced is not None and self._announced != points:
            raise malformed(f"the file announces {count_text(self._announced, 'point')}, but has {points}")
        if not points and self._announced is None:
            raise malformed("no point (a line of three numbers) found")
        return self._content

    def begins_with_a_point(self) -> bool:
        try:
            line = self._next_point_line()
            if line is not None:
                self._add_point(line)
        except ValueError:
            return False
        return line is not None

    def _add_regular_rows(self) -> None:
        """The lines that are what every writer writes, at once."""
        if self._content.vertex_count != 1 or (self._announced or 2) < 2:
            return
        most = (self._announced or (1 << 62)) - 1
        for block in self._file.regular_rows(most, least=max(self._at) + 1):
            self._content.add_vertices(block[:, self._at], lambda i: "")

    def _add_point(self, line: str) -> None:
        if "," in line and _has_decimal_commas(line):
            raise self._file.at_line("commas inside numbers: write decimals with a point, or separate columns with commas only")
        words = _columns(line)
        point = [0.0, 0.0, 0.0]
        # In the order of the line, so that the first wrong one is named.
        for at, axis in sorted(zip(self._at, range(3))):
            word = words[at] if at < len(words) else ""
            value = real_of(_without_quotes(word))
            if value is None:
                raise self._file.at_line(f"expected three numbers x y z, found {in_quotes_not_a_number(word)}")
            point[axis] = value
        self._content.add_vertex(point[0], point[1], point[2], lambda: f"line {self._file.line_number}")

    def _next_point_line(self) -> Optional[str]:
        """The next line that should be a point: not a comment, a header or a count."""
        while True:
            line = self._file.read_line()
            if line is None:
                return None
            line = line.lstrip(BLANKS)
            if not line or _COMMENT.match(line):
                if self._begins and line:
                    names = line.lstrip("#;%!/ \t")
                    self._commented = _column_names(names) if names else None
                continue
            if self._is_count(line):
                continue
            if not self._begins:
                return line
            self._begins = False
            named = _column_names(line)
            if named is not None:
                self._at = named.at
                continue
            # A sentence with these words has another number of words than the lines have columns.
            if self._commented is not None and self._commented.named == len(_columns(line)):
                self._at = self._commented.at
            return line

    def _is_count(self, line: str) -> bool:
        """The first line may be the number of points. In a file of several scans the number of the next follows the last
        point of each."""
        points = self._content.vertex_count
        first = self._begins and self._announced is None
        if not first and (points == 0 or self._announced != points):
            return False
        count = count_of(line.rstrip(BLANKS))
        if count is None:
            return False
        self._announced = points + count
        return True
