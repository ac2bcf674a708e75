# SPDX-License-Identifier: Apache-2.0
"""The header of a PLY file: its elements, their properties and the encoding."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import List, Optional, Tuple

import numpy as np

from ._scan_bytes import ScanBytes
from ._scan_words import count_of, in_quotes, malformed, printable, words_of

_TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "bool": "u1", "short": "i2", "int16": "i2", "ushort": "u2",
    "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4", "int64": "i8", "uint64": "u8",
    "float": "f4", "float32": "f4", "double": "f8", "float64": "f8",
}
_FORMATS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}


@dataclass
class Property:
    name: str
    type: str
    """Of the value, or of each entry of the list."""
    count_type: Optional[str] = None
    """Of a list: the type of its length."""

    @property
    def is_list(self) -> bool:
        return self.count_type is not None

    @property
    def is_floating(self) -> bool:
        return self.type[0] == "f"


@dataclass
class Element:
    name: str
    """In lower case."""
    count: int
    """As announced, not yet verified."""
    properties: List[Property] = field(default_factory=list)

    @property
    def has_lists(self) -> bool:
        return any(one.is_list for one in self.properties)

    def record(self, order: str) -> "np.dtype[np.void]":
        """Of an element without lists; fields have the numbers of their properties."""
        return np.dtype([(str(i), order + one.type) for i, one in enumerate(self.properties)])


def read_ply_header(file: ScanBytes) -> Tuple[str, List[Element]]:
    """The byte order ("" if the body is text) and the elements. Stops at the first byte after the header."""
    file.decode_text()
    start = file.peek(4)
    if len(start) < 4 or start[:3].lower() != b"ply" or start[3:] not in (b"\n", b" ", b"\t", b"\r", b"\v", b"\f"):
        raise malformed("line 1: expected 'ply'; this is not a PLY file")
    file.read_line()
    order: Optional[str] = None
    elements: List[Element] = []
    line = file.read_line()
    while line is not None:
        words = words_of(line)
        keyword = words[0].lower() if words else ""
        rest = words[1:] + ["", "", "", ""]
        if keyword == "end_header":
            if order is None:
                raise file.at_line("the header has no 'format' line")
            return order, elements
        if keyword == "format":
            order = _format(file, rest[0])
        elif keyword == "element":
            elements.append(_element(file, rest[0], rest[1]))
        elif keyword == "property":
            if not elements:
                raise file.at_line("'property' before any 'element'")
            elements[-1].properties.append(_property(file, rest))
        # Blender 2.4 left out "comment" before "Created by".
        elif keyword not in ("", "comment", "obj_info", "created"):
            raise file.at_line("expected format, element, property, comment, obj_info or end_header, "
                               f"found {in_quotes(keyword)}")
        line = file.read_line()
    raise file.at_line("the file ends before 'end_header'")


def _format(file: ScanBytes, word: str) -> str:
    if word.lower() in _FORMATS:
        return _FORMATS[word.lower()]
    raise file.at_line(f"expected format ascii, binary_little_endian or binary_big_endian, found {in_quotes(word)}")


def _element(file: ScanBytes, name: str, word: str) -> Element:
    count = count_of(word)
    if not name or count is None:
        raise file.at_line(f"expected 'element NAME COUNT', found count {in_quotes(word)}")
    return Element(printable(name).lower(), count)


def _property(file: ScanBytes, words: List[str]) -> Property:
    def type_of(word: str) -> str:
        if word.lower() in _TYPES:
            return _TYPES[word.lower()]
        raise file.at_line("expected a type (char uchar short ushort int uint float double, or int8 to float64), "
                           f"found {in_quotes(word)}")

    count_type = None
    if words[0].lower() == "list":
        count_type = type_of(words[1])
        if count_type[0] == "f":
            raise file.at_line(f"expected an integer type for the length of a list, found {in_quotes(words[1])}")
        words = words[2:]
    kind = type_of(words[0])
    if not words[1]:
        raise file.at_line("expected a property name, found nothing")
    return Property(printable(words[1]), kind, count_type)
