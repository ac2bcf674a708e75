# SPDX-License-Identifier: Apache-2.0
"""The header of a PCD file: its fields, the number of points and the encoding."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Dict, List, Sequence

from ._scan_bytes import ScanBytes
from ._scan_words import count_of, count_text, in_quotes, without_comment, words_of


@dataclass
class Field:
    name: str
    size: int = 4
    type: str = "F"
    count: int = 1

    @property
    def bytes(self) -> int:
        return self.size * self.count

    @property
    def is_padding(self) -> bool:
        """Before the next field."""
        return self.name == "_"


@dataclass
class Header:
    fields: List[Field]
    points: int
    encoding: str
    """ascii, binary or binary_compressed."""
    coordinates: List[int]
    """The fields x, y and z."""

    def bytes_before(self, field: int, with_padding: bool = True) -> int:
        return sum(one.bytes for one in self.fields[:field] if with_padding or not one.is_padding)

    def types(self) -> List[str]:
        """Of the coordinates, for numpy."""
        return [f"<{self.fields[at].type.lower()}{self.fields[at].size}" for at in self.coordinates]


def read_pcd_header(file: ScanBytes) -> Header:
    """Reads up to and including the line DATA."""
    parser = _Parser(file)
    line = file.read_line()
    while line is not None:
        words = words_of(without_comment(line))
        if words and parser.parse(words[0], words[1:]):
            return parser.checked()
        line = file.read_line()
    raise file.at_line("the file ends before the DATA line of the PCD header")


class _Parser:
    def __init__(self, file: ScanBytes) -> None:
        self._file = file
        self._fields: List[Field] = []
        self._coordinates: List[int] = []
        self._numbers: Dict[str, int] = {}
        self._encoding = ""

    def parse(self, word: str, rest: Sequence[str]) -> bool:
        """True if it was the last line."""
        keyword = word.upper()
        if keyword in ("FIELDS", "COLUMNS"):
            self._parse_fields(rest)
        elif keyword == "SIZE":
            for field, number in zip(self._fields, self._each(keyword, rest, 1, 8)):
                field.size = number
        elif keyword == "COUNT":  # 0 is what PCL writes of padding that is not needed
            for field, number in zip(self._fields, self._each(keyword, rest, 0, (1 << 32) - 1)):
                field.count = number
        elif keyword == "TYPE":
            self._parse_types(rest)
        elif keyword in ("WIDTH", "HEIGHT", "POINTS"):
            self._parse_number(keyword, rest[0] if rest else "")
        elif keyword == "DATA":
            self._parse_encoding(rest[0] if rest else "")
        elif keyword not in ("VERSION", "VIEWPOINT"):
            raise self._file.at_line("expected a PCD keyword (VERSION FIELDS SIZE TYPE COUNT WIDTH HEIGHT VIEWPOINT POINTS "
                                     f"DATA), found {in_quotes(word)}")
        return keyword == "DATA"

    def _parse_fields(self, names: Sequence[str]) -> None:
        if self._fields:
            raise self._file.at_line("a second FIELDS line")
        self._fields = [Field(name) for name in names]
        self._coordinates = [self._coordinate(axis) for axis in "xyz"]

    def _coordinate(self, axis: str) -> int:
        """A name in capitals counts if there is none in lower case."""
        for name in (axis, axis.upper()):
            at = [i for i, field in enumerate(self._fields) if field.name == name]
            if len(at) > 1:
                raise self._file.at_line(f"field '{name}' appears twice")
            if at:
                return at[0]
        raise self._file.at_line(f"FIELDS has no field '{axis}'")

    def _each(self, keyword: str, words: Sequence[str], least: int, most: int) -> List[int]:
        numbers = []
        for i, field in enumerate(self._fields):
            word = words[i] if i < len(words) else ""
            number = count_of(word)
            if number is None or not least <= number <= most:
                raise self._file.at_line(
                    f"expected {keyword} {least} to {most} for field {in_quotes(field.name)}, found {in_quotes(word)}")
            numbers.append(number)
        self._end_of_each(keyword, words)
        return numbers

    def _parse_types(self, words: Sequence[str]) -> None:
        for i, field in enumerate(self._fields):
            word = words[i] if i < len(words) else ""
            if word.upper() not in ("F", "I", "U"):
                raise self._file.at_line(f"expected TYPE F, I or U for field {in_quotes(field.name)}, found {in_quotes(word)}")
            field.type = word.upper()
        self._end_of_each("TYPE", words)

    def _end_of_each(self, keyword: str, words: Sequence[str]) -> None:
        if not self._fields or len(words) > len(self._fields):
            raise self._file.at_line(
                f"{keyword} must follow FIELDS and have one entry for each of its {count_text(len(self._fields), 'field')}")

    def _parse_number(self, keyword: str, word: str) -> None:
        number = count_of(word)
        if number is None:
            raise self._file.at_line(f"expected a number after {keyword}, found {in_quotes(word)}")
        self._numbers[keyword] = number

    def _parse_encoding(self, word: str) -> None:
        self._encoding = word.lower()
        if self._encoding not in ("ascii", "binary", "binary_compressed"):
            raise self._file.at_line(f"expected DATA ascii, binary or binary_compressed, found {in_quotes(word)}")

    def checked(self) -> Header:
        """Checks across lines; completes the number of points."""
        if not self._fields:
            raise self._file.at_line("the header has no FIELDS line")
        for at in self._coordinates:
            field = self._fields[at]
            if field.count != 1 or field.size not in ((4, 8) if field.type == "F" else (1, 2, 4, 8)):
                raise self._file.at_line(f"field '{field.name}' is {field.count} x {field.type}{field.size}; "
                                         "expected one F4, F8, I or U number")
        return Header(self._fields, self._points(), self._encoding, self._coordinates)

    def _points(self) -> int:
        width, points = self._numbers.get("WIDTH"), self._numbers.get("POINTS")
        height = self._numbers.get("HEIGHT", 1)
        # As PCL: a cloud without rows has one, and one without columns has all points in one row.
        if height == 0 and not width and points is not None:
            width = points
        if width is not None:
            product = width * max(height, 1)
            if product >= 1 << 64:
                raise self._file.at_line("WIDTH times HEIGHT is absurdly large")
            if points not in (None, product):
                raise self._file.at_line(f"POINTS is {points}, but WIDTH times HEIGHT is {product}")
            return product
        if points is None:
            raise self._file.at_line("the header has neither POINTS nor WIDTH")
        return points
