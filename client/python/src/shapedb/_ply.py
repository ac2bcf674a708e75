# SPDX-License-Identifier: Apache-2.0
"""PLY: ASCII and binary, of either byte order."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Dict, List, Optional, Tuple, Union

import numpy as np
import numpy.typing as npt

from ._errors import InvalidInput
from ._points import FloatArray

_TYPES = {
    "char": "i1", "int8": "i1", "uchar": "u1", "uint8": "u1", "short": "i2", "int16": "i2", "ushort": "u2",
    "uint16": "u2", "int": "i4", "int32": "i4", "uint": "u4", "uint32": "u4", "float": "f4", "float32": "f4",
    "double": "f8", "float64": "f8",
}
_FORMATS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
_CORNERS = ("vertex_indices", "vertex_index")


@dataclass
class _Property:
    name: str
    type: str
    count_type: Optional[str] = None
    """Of a list: the type of its length."""


@dataclass
class _Element:
    name: str
    count: int
    properties: List[_Property] = field(default_factory=list)


def read_ply(data: bytes) -> Tuple[FloatArray, npt.NDArray[np.int64]]:
    """Vertices and triangles; polygons are cut into fans. Raises `InvalidInput`."""
    order, elements, start = _header(data)
    body: Union[_Ascii, _Binary] = _Ascii(data[start:]) if order == "" else _Binary(data, start, order)
    vertices: Optional[FloatArray] = None
    triangles = np.zeros((0, 3), dtype=np.int64)
    for element in elements:
        columns = body.read(element)
        if element.name == "vertex":
            missing = [axis for axis in "xyz" if axis not in columns]
            if missing:
                raise _malformed(f"its vertices have no property {missing[0]}")
            vertices = np.stack([np.asarray(columns[axis], dtype=np.float64) for axis in "xyz"], axis=1)
        elif element.name == "face":
            polygons: Any = next((columns[name] for name in _CORNERS if name in columns), [])
            triangles = _triangles(polygons)
    if vertices is None:
        raise _malformed("it has no element 'vertex'")
    return vertices, triangles


def _malformed(what: str) -> InvalidInput:
    return InvalidInput("malformed_file", what)


def _header(data: bytes) -> Tuple[str, List[_Element], int]:
    order: Optional[str] = None
    elements: List[_Element] = []
    at = 0
    for number in range(1, 10_000):
        end = data.find(b"\n", at)
        if end < 0:
            raise _malformed("it ends in the middle of its header")
        words = data[at:end].decode("ascii", "replace").split()
        at = end + 1
        if number == 1:
            if words != ["ply"]:
                raise _malformed("line 1: expected 'ply'")
        elif words == ["end_header"]:
            if order is None:
                raise _malformed("its header names no format")
            return order, elements, at
        elif words and words[0] not in ("comment", "obj_info"):
            order = _header_line(words, number, order, elements)
    raise _malformed("its header has no end")


def _header_line(words: List[str], number: int, order: Optional[str], elements: List[_Element]) -> Optional[str]:
    if words[0] == "format" and len(words) == 3 and words[1] in _FORMATS:
        return _FORMATS[words[1]]
    if words[0] == "element" and len(words) == 3 and words[2].isdigit():
        elements.append(_Element(words[1], int(words[2])))
    elif words[0] == "property" and elements and len(words) == 3 and words[1] in _TYPES:
        elements[-1].properties.append(_Property(words[2], _TYPES[words[1]]))
    elif (words[0] == "property" and elements and len(words) == 5 and words[1] == "list" and words[2] in _TYPES
          and words[3] in _TYPES and _TYPES[words[2]][0] != "f"):
        elements[-1].properties.append(_Property(words[4], _TYPES[words[3]], _TYPES[words[2]]))
    else:
        raise _malformed(f"line {number}: not understood: '{' '.join(words)[:60]}'")
    return order


def _triangles(polygons: Any) -> npt.NDArray[np.int64]:
    if isinstance(polygons, np.ndarray):  # all of the same length
        corners = polygons.astype(np.int64)
        fans = [corners[:, [0, i, i + 1]] for i in range(1, corners.shape[1] - 1)]
        return np.concatenate(fans) if fans else np.zeros((0, 3), dtype=np.int64)
    fan = [(polygon[0], polygon[i], polygon[i + 1]) for polygon in polygons for i in range(1, len(polygon) - 1)]
    return np.array(fan, dtype=np.int64).reshape(-1, 3)


class _Ascii:
    """One element a line, as it should be; the values count, not the lines."""

    def __init__(self, body: bytes) -> None:
        self._values = body.split()
        self._at = 0

    def read(self, element: _Element) -> Dict[str, Any]:
        if all(one.count_type is None for one in element.properties):
            width = len(element.properties)
            values = self._values[self._at:self._at + element.count * width]
            if len(values) < element.count * width:
                raise _malformed(f"it has fewer than {element.count} of '{element.name}'")
            self._at += len(values)
            table = np.array(values, dtype="S").astype(np.float64).reshape(element.count, width)
            return {one.name: table[:, column] for column, one in enumerate(element.properties)}
        columns: Dict[str, Any] = {one.name: [] for one in element.properties}
        for index in range(element.count):
            for one in element.properties:
                if one.count_type is None:
                    columns[one.name].append(self._numbers(1, element, index)[0])
                else:
                    length = int(self._numbers(1, element, index)[0])
                    columns[one.name].append([int(value) for value in self._numbers(length, element, index)])
        return columns

    def _numbers(self, count: int, element: _Element, index: int) -> List[float]:
        values = self._values[self._at:self._at + count]
        if count < 0 or len(values) < count:
            raise _malformed(f"it ends in {element.name} {index} of {element.count}")
        self._at += count
        return [float(value) for value in values]


class _Binary:
    def __init__(self, data: bytes, at: int, order: str) -> None:
        self._data = data
        self._at = at
        self._order = order

    def read(self, element: _Element) -> Dict[str, Any]:
        uniform = self._uniform(element)
        return self._one_by_one(element) if uniform is None else uniform

    def _uniform(self, element: _Element) -> Optional[Dict[str, Any]]:
        """All records at once, if every list is as long as in the first; None if not."""
        fields: List[Any] = []
        at = self._at
        for number, one in enumerate(element.properties):
            if one.count_type is not None:
                count_type = np.dtype(self._order + one.count_type)
                if element.count == 0 or at + count_type.itemsize > len(self._data):
                    return None
                length = int(np.frombuffer(self._data, count_type, 1, at)[0])
                if not 0 <= length <= 16:
                    return None
                fields.append((f"count{number}", count_type))
                fields.append((f"value{number}", self._order + one.type, (length,)))
                at += count_type.itemsize + length * np.dtype(one.type).itemsize
            else:
                fields.append((f"value{number}", self._order + one.type))
                at += np.dtype(one.type).itemsize
        record = np.dtype(fields)
        if record.itemsize * element.count > len(self._data) - self._at:
            if any(one.count_type is not None for one in element.properties):
                return None  # of different lengths, perhaps
            raise _malformed(f"it has fewer than {element.count} of '{element.name}'")
        table = np.frombuffer(self._data, record, element.count, self._at)
        for number, one in enumerate(element.properties):
            if one.count_type is not None and (table[f"count{number}"] != table[f"value{number}"].shape[1]).any():
                return None
        self._at += record.itemsize * element.count
        return {one.name: table[f"value{number}"] for number, one in enumerate(element.properties)}

    def _one_by_one(self, element: _Element) -> Dict[str, Any]:
        columns: Dict[str, Any] = {one.name: [] for one in element.properties}
        for index in range(element.count):
            for one in element.properties:
                length = 1 if one.count_type is None else int(self._take(one.count_type, 1, element, index)[0])
                values = self._take(one.type, length, element, index)
                columns[one.name].append(values[0] if one.count_type is None else values)
        return columns

    def _take(self, kind: str, count: int, element: _Element, index: int) -> Any:
        dtype = np.dtype(self._order + kind)
        if count < 0 or self._at + count * dtype.itemsize > len(self._data):
            raise _malformed(f"it ends in {element.name} {index} of {element.count}")
        values = np.frombuffer(self._data, dtype, count, self._at).tolist()
        self._at += count * dtype.itemsize
        return values
