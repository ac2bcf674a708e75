# SPDX-License-Identifier: Apache-2.0
"""PCD of the Point Cloud Library: ascii, binary and binary_compressed."""

from __future__ import annotations

from typing import Any, List, Optional

import numpy as np
import numpy.typing as npt

from ._errors import InvalidInput
from ._pcd_header import Header, read_pcd_header
from ._points import FloatArray
from ._scan_bytes import ScanBytes
from ._scan_content import Content
from ._scan_words import count_text, in_quotes, in_quotes_not_a_number, real_of, without_comment, words_of

# LZF writes at most 264 bytes (its longest back reference) for 3 bytes read.
_LZF_GREATEST_RATIO = 88


def read_pcd(file: ScanBytes) -> Content:
    """A point with a coordinate that is not finite means "nothing measured here": it is skipped and counted."""
    file.decode_text()
    return _Body(file, read_pcd_header(file)).read()


class _Body:
    def __init__(self, file: ScanBytes, header: Header) -> None:
        self._file = file
        self._header = header
        self._content = Content()

    def read(self) -> Content:
        if self._header.encoding == "ascii":
            self._read_ascii()
            return self._content
        self._file.begin_binary()
        if self._header.encoding == "binary":
            self._read_binary()
        else:
            self._read_compressed()
        # PCL writes zero bytes after the points.
        if not self._file.only_padding_left():
            raise self._file.at_byte(self._file.offset, self._after_the_last())
        return self._content

    def _add(self, points: FloatArray) -> None:
        measured = np.isfinite(points).all(axis=1)
        self._content.skipped += int(np.count_nonzero(~measured))
        self._content.add_vertices(points[measured], lambda i: "")

    def _after_the_last(self) -> str:
        return f"data after the last of the announced {count_text(self._header.points, 'point')}"

    def _read_ascii(self) -> None:
        points, width = self._header.points, sum(field.count for field in self._header.fields)
        columns = [sum(field.count for field in self._header.fields[:at]) for at in self._header.coordinates]
        done = 0
        for block in self._file.regular_rows(points, width, width):
            self._add(block[:, columns])
            done += len(block)
        few: List[List[float]] = []
        for index in range(done, points):
            line = self._next_content_line()
            if line is None:
                raise self._file.after_last_line(f"the header announces {count_text(points, 'point')}, found {index}")
            few.append(self._ascii_point(words_of(line)))
        if few:
            self._add(np.array(few, dtype=np.float64))
        if self._next_content_line() is not None:
            raise self._file.at_line(self._after_the_last())

    def _next_content_line(self) -> Optional[str]:
        line = self._file.read_line()
        while line is not None:
            content = without_comment(line)
            if words_of(content):
                return content
            line = self._file.read_line()
        return None

    def _ascii_point(self, words: List[str]) -> List[float]:
        point = [0.0, 0.0, 0.0]
        at = 0
        for number, field in enumerate(self._header.fields):
            if at + field.count > len(words) and number not in self._header.coordinates:
                raise self._no_number(field.name, "")
            if number in self._header.coordinates:
                word = words[at] if at < len(words) else ""
                value = real_of(word)
                if value is None:
                    raise self._no_number(field.name, word)
                point[self._header.coordinates.index(number)] = value
            at += field.count
        if at < len(words):
            raise self._file.at_line(f"expected the line end after the last field, found {in_quotes(words[at])}")
        return point

    def _no_number(self, field: str, word: str) -> InvalidInput:
        return self._file.at_line(f"expected a number for field {in_quotes(field)}, found {in_quotes_not_a_number(word)}")

    def _read_binary(self) -> None:
        header, file = self._header, self._file
        size = header.bytes_before(len(header.fields))
        room = file.remaining // size
        if header.points > room:
            raise self._too_short(f"the header announces {count_text(header.points, 'point')} of {count_text(size, 'byte')}, "
                                  f"but the file has room for {room}")
        if header.points == 0:
            return
        columns: List[npt.NDArray[Any]] = [
            np.ndarray((header.points,), kind, file.data, file.offset + header.bytes_before(at), (size,))
            for at, kind in zip(header.coordinates, header.types())]
        self._add(np.stack([column.astype(np.float64) for column in columns], axis=1))
        file.offset += header.points * size

    def _read_compressed(self) -> None:
        """Two sizes, then LZF data: all values of the first field, all of the second, ..."""
        header, file = self._header, self._file
        if file.remaining < 8:
            raise self._too_short("expected the compressed and the uncompressed size")
        packed, unpacked = (int(size) for size in np.frombuffer(file.data, "<u4", 2, file.offset))
        file.offset += 8
        # PCL leaves padding out of compressed data; others write it.
        sizes = [header.bytes_before(len(header.fields), with_padding) for with_padding in (False, True)]
        if unpacked not in [size * header.points for size in sizes]:
            raise self._too_short("the compressed data does not unpack to the announced "
                                  f"{count_text(header.points, 'point')} of {count_text(sizes[0], 'byte')}")
        if header.points == 0:
            return
        if unpacked > packed * _LZF_GREATEST_RATIO or file.remaining < packed:
            raise self._too_short(
                f"the compressed data is cut short: announced {packed} bytes for {unpacked}, found {file.remaining}")
        source = file.data[file.offset:file.offset + packed]
        data = unpack_lzf(source, unpacked)
        if data is None:
            # Some programs write data that does not get smaller as it is.
            if packed != unpacked:
                raise self._too_short("the compressed data is damaged")
            data = source
        file.offset += packed
        self._read_field_by_field(data, unpacked != sizes[0] * header.points)

    def _read_field_by_field(self, data: bytes, with_padding: bool) -> None:
        header = self._header
        columns = [np.frombuffer(data, kind, header.points, header.bytes_before(at, with_padding) * header.points)
                   for at, kind in zip(header.coordinates, header.types())]
        self._add(np.stack([column.astype(np.float64) for column in columns], axis=1))

    def _too_short(self, what: str) -> InvalidInput:
        return self._file.at_byte(self._file.offset, what)


def unpack_lzf(packed: bytes, size: int) -> Optional[bytes]:
    """None if the data is damaged or does not unpack to `size` bytes. Literals, and references to what came before."""
    out = bytearray()
    at, end = 0, len(packed)
    while at < end:
        control = packed[at]
        at += 1
        if control < 32:
            if at + control + 1 > end:
                return None
            out += packed[at:at + control + 1]
            at += control + 1
        else:
            length = (control >> 5) + 2
            if at + (2 if length == 9 else 1) > end:
                return None
            if length == 9:
                length += packed[at]
                at += 1
            distance = ((control & 31) << 8) + packed[at] + 1
            at += 1
            if distance > len(out):
                return None
            begin = len(out) - distance
            # The reference may go on into what it makes.
            piece = bytes(out[begin:begin + length])
            out += (piece * (length // len(piece) + 1))[:length]
        if len(out) > size:
            return None
    return bytes(out) if len(out) == size else None
