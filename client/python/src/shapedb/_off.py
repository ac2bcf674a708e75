# SPDX-License-Identifier: Apache-2.0
"""OFF as text, with the prefixes that only add data to vertices."""

from __future__ import annotations

import re

import numpy as np

from ._errors import InvalidInput
from ._scan_bytes import ScanBytes, WordReader
from ._scan_content import Content
from ._scan_words import count_of, count_text, in_quotes, in_quotes_not_a_number, real_of

_NAME = re.compile("(st)?(c)?(n)?(o)ff", re.IGNORECASE)


def read_off(file: ScanBytes) -> Content:
    return _Reader(file).read()


class _Reader:
    def __init__(self, file: ScanBytes) -> None:
        self._file = file
        self._words = WordReader(file)
        self._content = Content()
        self._vertices = 0
        self._faces = 0
        self._extra_numbers = 0
        """Of a vertex, after its coordinates."""
        self._on_counts_line = False
        self._word_by_word = False

    def read(self) -> Content:
        self._file.decode_text()
        self._read_header()
        self._word_by_word = self._words.has_fewer_lines_than(self._vertices + self._faces)
        if self._on_counts_line:
            self._end_record()
        for index in range(self._vertex_rows(), self._vertices):
            self._read_vertex(index)
        for index in range(self._face_rows(), self._faces):
            self._read_face(index)
        if self._words.next():
            raise self._file.at_line("data after the last of the announced "
                                     f"{count_text(self._vertices, 'vertex', 'vertices')} and {count_text(self._faces, 'face')}")
        return self._content

    def _read_header(self) -> None:
        """ "OFF 8 6 12", "OFF8 6 12" (in well-known collections), or without the word."""
        word = self._words.next()
        if not word:
            raise self._file.at_line("expected OFF; the file has no content")
        name = word.lower().find("off")
        if name >= 0:
            prefix = _NAME.match(word)
            # "nOFF" has vertices of another dimension.
            if prefix is None or (prefix[3] == "n" and prefix[4] == "O"):
                raise self._file.at_line(
                    f"expected OFF, COFF, NOFF, STOFF or a mix of these prefixes, found {in_quotes(word[:name + 3])}")
            self._extra_numbers = sum(numbers for found, numbers in zip(prefix.groups(), (2, 4, 3)) if found)
            word = word[prefix.end():] or self._words.next()
            if word.lower() == "binary":
                raise self._file.at_line("binary OFF is not read; convert the file to text OFF or PLY")
            if not word:
                raise self._cut_short("the numbers of vertices and faces")
        self._vertices = self._count(word)
        self._faces = self._count(self._words.next())
        # The number of edges may be missing. It is there if it is on the line, or on one of its own.
        self._on_counts_line = not self._words.at_line_end()
        if self._on_counts_line or (self._words.next_line() and len(self._words.words_on_line()) == 1):
            self._words.next()

    def _count(self, word: str) -> int:
        count = count_of(word)
        if count is None:
            raise self._file.at_line(f"expected the numbers of vertices and faces, found {in_quotes_not_a_number(word)}")
        return count

    def _end_record(self) -> None:
        """What follows on the line is ignored: normal, colour, texture position."""
        if not self._word_by_word:
            self._words.end_line()

    def _vertex_rows(self) -> int:
        """The lines that are what every writer writes, at once; returns how many."""
        if self._word_by_word or not self._words.at_line_end():
            return 0
        blocks = self._file.regular_rows(self._vertices)
        for block in blocks:
            self._content.add_vertices(block[:, :3], lambda i: "")
        return sum(len(block) for block in blocks)

    def _face_rows(self) -> int:
        if self._word_by_word or not self._words.at_line_end():
            return 0
        at, line = self._file.offset, self._file.line_number
        blocks = self._file.regular_rows(self._faces, whole=True)
        for block in blocks:
            length = int(block[0, 0])
            if (not 1 <= length < block.shape[1] or (block[:, 0] != length).any()
                    or block[:, 1:length + 1].max() >= self._vertices):
                self._file.offset, self._file.line_number = at, line
                return 0
        for block in blocks:
            self._content.add_fans(block[:, 1:int(block[0, 0]) + 1].astype(np.int64))
        return sum(len(block) for block in blocks)

    def _read_vertex(self, index: int) -> None:
        point = []
        for _ in range(3):
            word = self._words.next()
            if not word:
                raise self._cut_short(f"vertex {index} of {self._vertices}")
            value = real_of(word)
            if value is None:
                raise self._file.at_line(
                    f"expected three numbers for vertex {index} of {self._vertices}, found {in_quotes_not_a_number(word)}")
            point.append(value)
        self._content.add_vertex(point[0], point[1], point[2], lambda: f"line {self._file.line_number}")
        if self._word_by_word:
            for _ in range(self._extra_numbers):
                self._words.next()
        self._end_record()

    def _read_face(self, index: int) -> None:
        name = f"face {index} of {self._faces}"
        word = self._words.next()
        if not word:
            raise self._cut_short(name)
        length = count_of(word)
        if length is None:
            raise self._file.at_line(f"expected the number of corners of {name}, found {in_quotes_not_a_number(word)}")
        corners = []
        for i in range(length):
            word = self._words.next()
            if not word:
                raise self._cut_short(f"corner {i} of {name}")
            corner = count_of(word)
            if corner is None:
                raise self._file.at_line(f"expected corner {i} of {name}, found {in_quotes_not_a_number(word)}")
            if corner >= self._vertices:
                raise self._file.at_line(f"{name} names vertex {corner}, but the file has "
                                         f"{count_text(self._vertices, 'vertex', 'vertices')}, counted from 0")
            corners.append(corner)
        self._content.add_fan(corners)
        self._end_record()

    def _cut_short(self, expected: str) -> InvalidInput:
        return self._file.after_last_line(f"expected {expected}")
