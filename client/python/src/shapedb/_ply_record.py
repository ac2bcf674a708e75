# SPDX-License-Identifier: Apache-2.0
"""The two ways to read one record of a PLY element, with one interface. What cannot be read is None, or False."""

from __future__ import annotations

from typing import Callable, List, Optional, Union

import numpy as np

from ._errors import InvalidInput
from ._ply_header import Element
from ._scan_bytes import ScanBytes, WordReader
from ._scan_words import in_quotes_not_a_number, integer_of, real_of


def record_name(element: Element, index: int) -> str:
    return f"{element.name} {index} of {element.count}"


class TextRecord:
    """One element a line. A record may go on on the next line, but then ends with it, so that a missing number is found
    where it is missing; only a file with fewer lines than records is read word by word."""

    def __init__(self, file: ScanBytes, words: WordReader, word_by_word: bool) -> None:
        self._file = file
        self._words = words
        self._word_by_word = word_by_word
        self._line = 0
        self._word = ""

    def begin(self) -> bool:
        if self._words.at_line_end() and not self._words.next_line():
            return False
        self._line = self._file.line_number
        return True

    def real(self, kind: str) -> Optional[float]:
        return real_of(self._next())

    def integer(self, kind: str) -> Optional[int]:
        return integer_of(self._next())

    def integers(self, kind: str, count: int, good: Callable[[int], bool]) -> List[int]:
        """As many as can be read, up to the first that is not good."""
        values: List[int] = []
        while len(values) < count and (not values or good(values[-1])):
            value = self.integer(kind)
            if value is None:
                break
            values.append(value)
        return values

    def skip(self, kind: str, count: int) -> bool:
        for _ in range(count):
            if not self._next():
                return False
        return True

    def end(self) -> bool:
        return self._word_by_word or self._words.at_line_end() or not self._next()

    def where(self) -> str:
        return f"line {self._file.line_number}"

    def fault(self, element: Element, index: int, what: str) -> InvalidInput:
        if self._words.ended:
            return self._file.after_last_line(f"expected {what + ' of ' if what else ''}{record_name(element, index)}")
        begun = f", which begins in line {self._line}" if self._line < self._file.line_number else ""
        return self._file.at_line(
            f"expected {what} of {record_name(element, index)}{begun}, found {in_quotes_not_a_number(self._word)}")

    def _next(self) -> str:
        self._word = self._words.next()
        return self._word


class BinaryRecord:
    def __init__(self, file: ScanBytes, order: str) -> None:
        self._file = file
        self._order = order
        self._start = 0

    def begin(self) -> bool:
        self._start = self._file.offset
        return True

    def real(self, kind: str) -> Optional[float]:
        values = self._take(kind, 1)
        return float(values[0]) if values else None

    def integer(self, kind: str) -> Optional[int]:
        values = self._take(kind, 1)
        return int(values[0]) if values else None

    def integers(self, kind: str, count: int, good: Callable[[int], bool]) -> List[int]:
        """As many as can be read."""
        return [int(value) for value in self._take(kind, count)]

    def skip(self, kind: str, count: int) -> bool:
        size = count * np.dtype(kind).itemsize
        if size > self._file.remaining:
            return False
        self._file.offset += size
        return True

    def end(self) -> bool:
        return True

    def where(self) -> str:
        return f"byte {self._start}"

    def fault(self, element: Element, index: int, what: str) -> InvalidInput:
        return self._file.at_byte(self._start, f"the file ends inside {record_name(element, index)}: expected {what}")

    def _take(self, kind: str, count: int) -> List[Union[int, float]]:
        dtype = np.dtype(self._order + kind)
        count = min(count, self._file.remaining // dtype.itemsize)
        values: List[Union[int, float]] = np.frombuffer(self._file.data, dtype, count, self._file.offset).tolist()
        self._file.offset += count * dtype.itemsize
        return values


Record = Union[TextRecord, BinaryRecord]
