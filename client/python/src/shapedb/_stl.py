# SPDX-License-Identifier: Apache-2.0
"""STL, binary and ASCII. Corners at the same position become one vertex."""

from __future__ import annotations

import math
import re
from typing import Dict, List, Tuple

import numpy as np

from ._errors import InvalidInput
from ._scan_bytes import ScanBytes, WordReader
from ._scan_content import Content
from ._scan_words import (count_text, in_quotes, in_quotes_not_a_number, malformed, not_finite, real_of, without_comment,
                          words_of)

_HEADER_BYTES = 80
_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_SNIFFED_BYTES = 1024  # a text file this long without a zero byte is text


def read_stl(file: ScanBytes) -> Content:
    return _read_ascii(file) if _looks_ascii(file) else _read_binary(file)


def _looks_ascii(file: ScanBytes) -> bool:
    """Binary files may start with "solid" too, so the exact size of a binary file, or a zero byte, decides."""
    room = file.remaining - _HEADER_BYTES - 4
    if room >= 0 and room == _RECORD.itemsize * _announced(file):
        return False
    file.decode_text()
    # Zero bytes may fill up the end of a text file.
    head = file.peek(_SNIFFED_BYTES).rstrip(b"\0")
    return _first_word(head)[:5].lower() == "solid" and b"\0" not in head


def _first_word(text: bytes) -> str:
    """After blank lines and comments."""
    for line in re.split(r"[\r\n]", text.decode("latin-1")):
        for word in words_of(without_comment(line)):
            return word
    return ""


def _announced(file: ScanBytes) -> int:
    begin = file.offset + _HEADER_BYTES
    return int.from_bytes(file.data[begin:begin + 4], "little")


def _read_binary(file: ScanBytes) -> Content:
    if file.remaining < _HEADER_BYTES + 4:
        raise malformed(
            f"expected 'solid' (ASCII STL) or the 84 bytes a binary STL starts with, found {file.remaining} bytes")
    head = file.peek(_SNIFFED_BYTES)
    if not re.search(rb"[\0-\x08\x0e-\x1f\x7f]", head):
        raise malformed(f"expected 'solid', found {in_quotes(_first_word(head))}; this is not an ASCII STL file, and its size is not that of a binary one")
    count = _announced(file)
    file.offset += _HEADER_BYTES + 4
    room = file.remaining // _RECORD.itemsize
    if count > room:
        # Four letters where the number of triangles stands are no number.
        if re.fullmatch(rb"[\t-~]{4}", file.data[file.offset - 4:file.offset]):
            raise malformed("this is not an STL file: it does not begin with 'solid' and does not have the size of a binary one")
        raise file.at_byte(_HEADER_BYTES,
                           f"the header announces {count_text(count, 'triangle')}, but the file has room for {room}")
    corners = np.frombuffer(file.data, _RECORD, count, file.offset)["corners"].astype(np.float64).reshape(-1, 3)
    content = Content()
    good = np.isfinite(corners).all(axis=1)
    if not good.all():
        first = int(np.argmin(good))
        before = len(np.unique(corners[:first] + 0.0, axis=0))
        raise not_finite(f"byte {file.offset + first // 3 * _RECORD.itemsize}, triangle {first // 3}", before)
    file.offset += count * _RECORD.itemsize
    _add_merged(content, corners)
    if not file.only_padding_left():
        raise file.at_byte(file.offset, f"data after the last of the announced {count_text(count, 'triangle')}")
    return content


def _add_merged(content: Content, corners: "np.ndarray[Tuple[int, int], np.dtype[np.float64]]") -> None:
    """Vertices in the order in which they appear first."""
    if not len(corners):
        return
    # Adding zero turns -0 into 0: they are equal.
    _, first, index = np.unique(corners + 0.0, axis=0, return_index=True, return_inverse=True)
    order = np.argsort(first, kind="stable")
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    content.add_vertices(corners[first[order]], lambda i: "")
    content.add_fans(rank[np.asarray(index).reshape(-1)].reshape(-1, 3).astype(np.int64))


def _read_ascii(file: ScanBytes) -> Content:
    """solid (facet, outer loop, vertex x 3, endloop, endfacet)* endsolid, one or more times. Line ends are no more than
    blanks, but for the names of solids, which may have several words."""
    return _AsciiReader(file).read()


class _AsciiReader:
    def __init__(self, file: ScanBytes) -> None:
        self._file = file
        self._words = WordReader(file)
        self._content = Content()
        self._vertex_at: Dict[Tuple[float, float, float], int] = {}

    def read(self) -> Content:
        word = self._next_keyword()
        while word:
            if word.lower() != "solid":
                raise self._unexpected("solid", word)
            self._skip_name()
            word = self._next_keyword()
            # Some programs write the name after "endsolid" without a blank.
            while not word.lower().startswith("endsolid"):
                if self._words.ended:
                    raise self._unexpected("endsolid", word)
                if word.lower() != "facet":
                    raise self._unexpected("facet", word)
                self._read_facet()
                word = self._next_keyword()
            self._words.end_line()
            word = self._next_keyword()
        return self._content

    def _next_keyword(self) -> str:
        """Some programs write "end loop", "end facet" and "end solid"."""
        word = self._words.next()
        return "end" + self._words.next_on_line() if word.lower() == "end" else word

    def _skip_name(self) -> None:
        """A solid may also stand on one line with its facets."""
        words = [word.lower() for word in self._words.words_on_line()]
        facets = [i for i in range(len(words) - 1) if words[i] == "facet" and words[i + 1] == "normal"]
        for _ in range(facets[0] if facets else len(words)):
            self._words.next_on_line()

    def _read_facet(self) -> None:
        word = self._words.next()
        if word.lower() == "normal":
            word = self._words.next()
            for _ in range(3):
                if word.lower() != "outer":
                    word = self._words.next()
        if word.lower() != "outer":
            raise self._unexpected("outer", word)
        self._expect("loop")
        corners = []
        for _ in range(3):
            self._expect("vertex")
            corners.append(self._read_corner())
        self._expect("endloop")
        self._expect("endfacet")
        self._content.add_fan(corners)

    def _expect(self, keyword: str) -> None:
        word = self._next_keyword()
        if word.lower() != keyword:
            raise self._unexpected(keyword, word)

    def _unexpected(self, keyword: str, word: str) -> InvalidInput:
        if self._words.ended:
            return self._file.after_last_line(f"expected '{keyword}'")
        return self._file.at_line(f"expected '{keyword}', found {in_quotes(word)}")

    def _read_corner(self) -> int:
        begun = self._file.line_number
        point: List[float] = []
        for _ in range(3):
            word = self._words.next()
            value = real_of(word)
            if value is None:
                same_line = begun == self._file.line_number and not self._words.ended
                raise self._file.at_line("expected three numbers after 'vertex', found "
                                         f"{in_quotes_not_a_number(word) if same_line else 'nothing'}", begun)
            point.append(value)
        x, y, z = point
        # -0.0 and 0.0 are equal, and have one hash.
        if (x, y, z) not in self._vertex_at or not all(map(math.isfinite, point)):
            self._content.add_vertex(x, y, z, lambda: f"line {self._file.line_number}")
            self._vertex_at[x, y, z] = self._content.vertex_count - 1
        return self._vertex_at[x, y, z]
