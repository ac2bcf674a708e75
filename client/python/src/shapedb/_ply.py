# SPDX-License-Identifier: Apache-2.0
"""PLY: ASCII and binary, of either byte order, any elements and properties in any order."""

from __future__ import annotations

from typing import Any, List, NamedTuple, Optional

import numpy as np

from ._ply_header import Element, Property, read_ply_header
from ._ply_record import BinaryRecord, Record, TextRecord, record_name
from ._scan_bytes import ScanBytes, WordReader
from ._scan_content import Content
from ._scan_words import count_text, malformed

_FACES = ("face", "faces", "polygon", "polygons", "triangle", "triangles")
_MOST_VERTICES = (1 << 32) - 1
_MOST_CORNERS_AT_ONCE = 16
_MOST_GUESSED_CORNERS = 64


def read_ply(file: ScanBytes) -> Content:
    """Polygons and strips are cut into triangles. Raises `InvalidInput`."""
    order, elements = read_ply_header(file)
    return _Body(file, order, elements).read()


def _coordinates(vertex: Element) -> List[int]:
    """The properties x, y and z. A name in capitals counts if there is none in lower case."""
    found = []
    for axis in "xyz":
        for name in (axis, axis.upper()):
            at = [i for i, one in enumerate(vertex.properties) if one.name == name]
            if len(at) > 1 or any(vertex.properties[i].is_list for i in at):
                raise malformed(f"header: element vertex needs one number '{name}', not a list or two of them")
            if at:
                found.append(at[0])
                break
        else:
            raise malformed(f"header: element vertex has no property '{axis}'")
    return found


class _Indices(NamedTuple):
    at: Optional[int] = None
    """The list that names the corners of faces or strips."""
    guessed: bool = False
    """It does if every entry could."""


def _indices(element: Element) -> _Indices:
    """Passing over faces in silence would take a mesh for a few points, so the only list of integers of a face counts
    under any name, and a face without any list of integers is an error."""
    # A grid names the vertex at each place, of which there is one or none.
    if element.name in ("vertex", "range_grid"):
        return _Indices()
    lists = [i for i, one in enumerate(element.properties) if one.is_list]
    named = [i for i in lists if element.properties[i].name.lower() in ("vertex_indices", "vertex_index")]
    if named:
        if not element.properties[named[-1]].is_floating:
            return _Indices(named[-1])
        raise malformed(f"header: the indices of element {element.name} must be integers, not float or double")
    whole = [i for i in lists if not element.properties[i].is_floating]
    face = element.name in _FACES or element.name == "tristrips"
    if element.count == 0 or (not face and len(whole) != 1):
        return _Indices()
    if len(whole) == 1:
        return _Indices(whole[0], not face)
    raise malformed(f"header: element {element.name} needs a list vertex_indices, which names its corners"
                    + ("; it has several lists under other names" if len(whole) > 1 else ""))


class _Guess:
    """Whether the only list of integers of an unknown element names corners of faces: every entry must name three vertices
    or more, each once. Longer ones are groups of points."""

    def __init__(self, name: str) -> None:
        self.name = name
        self.good = True
        self.polygons: List[List[int]] = []

    def add(self, corners: List[int], vertex_count: int) -> None:
        self.good = (self.good and 3 <= len(corners) <= _MOST_GUESSED_CORNERS and len(set(corners)) == len(corners)
                     and min(corners) >= 0 and max(corners) < vertex_count)
        if self.good:
            self.polygons.append(corners)


class _Body:
    def __init__(self, file: ScanBytes, order: str, elements: List[Element]) -> None:
        vertices = [one for one in elements if one.name == "vertex"]
        if len(vertices) > 1:
            raise malformed("header: element vertex appears twice")
        if not vertices:
            raise malformed("header: there is no element vertex")
        self._file = file
        self._order = order
        # An element without properties has no body, whatever its count says.
        self._elements = [one for one in elements if one.properties]
        self._coordinates = _coordinates(vertices[0])
        self._vertex_count = vertices[0].count
        self._words = WordReader(file, ("comment", "obj_info"))
        self._word_by_word = False
        self._content = Content()

    def read(self) -> Content:
        text = self._order == ""
        if text:
            self._word_by_word = self._words.has_fewer_lines_than(sum(one.count for one in self._elements))
        else:
            self._file.begin_binary()
        guesses = []
        for element in self._elements:
            indices = _indices(element)
            guess = None
            if indices.guessed and indices.at is not None:
                guess = _Guess(f"list {element.properties[indices.at].name} of element {element.name}")
                guesses.append(guess)
            self._read_element(element, indices.at, guess)
        self._settle(guesses)
        after = "data after the last element; the header announces too few"
        if text and self._words.next():
            raise self._file.at_line(after)
        if not text and not self._file.only_padding_left():
            raise self._file.at_byte(self._file.offset, after)
        return self._content

    def _settle(self, guesses: List[_Guess]) -> None:
        """Faces under unknown names, if there are no others."""
        has_faces = self._content.has_triangles
        for guess in guesses:
            if has_faces or not guess.good:
                self._content.ignored.append(guess.name)
            else:
                for corners in guess.polygons:
                    self._content.add_fan(corners)

    def _read_element(self, element: Element, indices: Optional[int], guess: Optional[_Guess]) -> None:
        if self._order == "":
            done = 0 if guess or self._word_by_word or not self._words.at_line_end() else self._read_rows(element, indices)
            record: Record = TextRecord(self._file, self._words, self._word_by_word)
        elif not element.has_lists:
            self._read_fixed(element)
            return
        else:
            done = 0 if guess else self._read_alike(element, indices)
            record = BinaryRecord(self._file, self._order)
        if element.name == "vertex":
            self._read_vertices(record, element, done)
        else:
            self._read_records(record, element, done, indices, guess)

    def _read_rows(self, element: Element, indices: Optional[int]) -> int:
        """The lines that are what every writer writes, at once; returns how many."""
        if not element.has_lists:
            width = len(element.properties)
            blocks = self._file.regular_rows(element.count, width, width)
            if element.name == "vertex":
                for block in blocks:
                    self._content.add_vertices(block[:, self._coordinates], lambda i: "")
            return sum(len(block) for block in blocks)
        # Triangles or squares, and nothing else on the line.
        if len(element.properties) > 1 or indices is None or element.name == "tristrips":
            return 0
        at, line = self._file.offset, self._file.line_number
        blocks = self._file.regular_rows(element.count, whole=True)
        for block in blocks:
            most = min(self._vertex_count, _MOST_VERTICES)
            if (block[:, 0] != block.shape[1] - 1).any() or block[:, 1:].max() >= most:
                self._file.offset, self._file.line_number = at, line
                return 0
        for block in blocks:
            self._content.add_fans(block[:, 1:].astype(np.int64))
        return sum(len(block) for block in blocks)

    def _read_fixed(self, element: Element) -> None:
        """Binary, without lists: all records have one size."""
        record = element.record(self._order)
        start, room = self._file.offset, self._file.remaining // record.itemsize
        if element.count > room:
            raise self._file.at_byte(start, f"the header announces {count_text(element.count, element.name + ' record')} of "
                                            f"{count_text(record.itemsize, 'byte')}, but the file has room for {room}")
        if element.name == "vertex":
            table = np.frombuffer(self._file.data, record, element.count, start)
            points = np.stack([table[str(at)].astype(np.float64) for at in self._coordinates], axis=1)
            self._content.add_vertices(points, lambda i: f"byte {start + i * record.itemsize}")
        self._file.offset += element.count * record.itemsize

    def _read_alike(self, element: Element, indices: Optional[int]) -> int:
        """All binary records at once, if every list is as long as in the first; returns how many."""
        if element.count == 0 or element.name == "tristrips":
            return 0
        fields: List[Any] = []
        at = self._file.offset
        for number, one in enumerate(element.properties):
            kind: Any = (f"value{number}", self._order + one.type)
            if one.count_type is not None:
                count_type = np.dtype(self._order + one.count_type)
                if at + count_type.itemsize > len(self._file.data):
                    return 0
                length = int(np.frombuffer(self._file.data, count_type, 1, at)[0])
                if not 0 <= length <= _MOST_CORNERS_AT_ONCE:
                    return 0
                fields.append((f"count{number}", count_type))
                kind = (*kind, (length,))
            fields.append(kind)
            at = self._file.offset + np.dtype(fields).itemsize
        record = np.dtype(fields)
        if record.itemsize * element.count > self._file.remaining:
            return 0
        table = np.frombuffer(self._file.data, record, element.count, self._file.offset)
        for number, one in enumerate(element.properties):
            if one.is_list and (table[f"count{number}"] != table[f"value{number}"].shape[1]).any():
                return 0
        if indices is not None and table[f"value{indices}"].size:
            corners = table[f"value{indices}"]
            if corners.min() < 0 or corners.max() >= min(self._vertex_count, _MOST_VERTICES):
                return 0
            self._content.add_fans(corners.astype(np.int64))
        if element.name == "vertex":
            points = np.stack([table[f"value{axis}"].astype(np.float64) for axis in self._coordinates], axis=1)
            begin = self._file.offset
            self._content.add_vertices(points, lambda i: f"byte {begin + i * record.itemsize}")
        self._file.offset += record.itemsize * element.count
        return element.count

    def _read_vertices(self, record: Record, element: Element, done: int) -> None:
        for index in range(done, element.count):
            if not record.begin():
                raise record.fault(element, index, "")
            point = [0.0, 0.0, 0.0]
            for number, one in enumerate(element.properties):
                if number not in self._coordinates:
                    _skip(record, element, index, one)
                    continue
                value = record.real(one.type)
                if value is None:
                    raise record.fault(element, index, f"the number {one.name}")
                point[self._coordinates.index(number)] = value
            _end(record, element, index)
            self._content.add_vertex(point[0], point[1], point[2], record.where)

    def _read_records(self, record: Record, element: Element, done: int, indices: Optional[int],
                      guess: Optional[_Guess]) -> None:
        for index in range(done, element.count):
            if not record.begin():
                raise record.fault(element, index, "")
            for number, one in enumerate(element.properties):
                if number == indices:
                    self._read_corners(record, element, index, one, guess)
                else:
                    _skip(record, element, index, one)
            _end(record, element, index)

    def _read_corners(self, record: Record, element: Element, index: int, one: Property, guess: Optional[_Guess]) -> None:
        length = _length(record, element, index, one)
        strips = element.name == "tristrips"
        most = min(self._vertex_count, _MOST_VERTICES)

        def good(corner: int) -> bool:
            return guess is not None or 0 <= corner < most or (strips and corner == -1)

        corners = record.integers(one.type, length, good)
        for corner in corners:
            if not good(corner):
                raise malformed(f"{record.where()}: {record_name(element, index)} names vertex {corner}, but the file has "
                                f"{count_text(self._vertex_count, 'vertex', 'vertices')}, counted from 0")
        if len(corners) < length:
            raise record.fault(element, index, f"entry {len(corners)} of {one.name}")
        if guess is not None:
            guess.add(corners, self._vertex_count)
        elif strips:
            self._add_strips(corners)
        else:
            self._content.add_fan(corners)

    def _add_strips(self, corners: List[int]) -> None:
        """-1 ends a strip and starts the next one in the same list."""
        begin = 0
        for end in [i for i, corner in enumerate(corners) if corner == -1] + [len(corners)]:
            self._content.add_strip(corners[begin:end])
            begin = end + 1


def _length(record: Record, element: Element, index: int, one: Property) -> int:
    if one.count_type is None:
        return 1
    length = record.integer(one.count_type)
    if length is None:
        raise record.fault(element, index, f"the length of list {one.name}")
    if length < 0:
        raise malformed(f"{record.where()}: {record_name(element, index)} has a list of negative length")
    return length


def _skip(record: Record, element: Element, index: int, one: Property) -> None:
    if not record.skip(one.type, _length(record, element, index, one)):
        raise record.fault(element, index, one.name)


def _end(record: Record, element: Element, index: int) -> None:
    if not record.end():
        raise record.fault(element, index, "the line end after the last value")
