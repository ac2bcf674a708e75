# SPDX-License-Identifier: Apache-2.0
"""A file read front to back, as client/io/input_file.h and word_reader.h do."""

from __future__ import annotations

import re
from typing import List, Optional, Pattern, Sequence

import numpy as np
import numpy.typing as npt

from ._errors import InvalidInput
from ._scan_words import malformed, without_comment, words_of

_LINE_END = re.compile(rb"\r\n|\r|\n")
_FILE_END = re.compile(rb"[\0\x1a \t]*")
_NUMBERS = re.compile(rb"[0-9+\-.eE \t\r\n]*")
_COUNTS = re.compile(rb"[0-9 \t\r\n]*")
_ROWS_AT_ONCE = 1 << 16
_LONG_FILE = 1 << 20
# More of them after binary data may be points: a point of three floats has twelve bytes.
_MOST_BLANKS_OF_PADDING = 4


class ScanBytes:
    def __init__(self, data: bytes) -> None:
        self.data = data
        self.offset = 0
        self.line_number = 0
        """Of the line last read, from 1."""
        self._recoded = False
        self._line_ends = (b"", b"")

    @property
    def remaining(self) -> int:
        return len(self.data) - self.offset

    def peek(self, count: int) -> bytes:
        return self.data[self.offset:self.offset + count]

    def decode_text(self) -> None:
        """To be called at the start of a file of text. Skips the mark of UTF-8; UTF-16 is read as UTF-8 from now on."""
        start = self.peek(4)
        if start.startswith(b"\xef\xbb\xbf"):
            self.offset += 3
            return
        if start in (b"\xff\xfe\0\0", b"\0\0\xfe\xff"):
            raise malformed("UTF-32 text is not read; save the file as UTF-8")
        marked = start[:2] in (b"\xff\xfe", b"\xfe\xff")
        # Without a mark every second byte of the first letters is zero.
        big = start[:2] == b"\xfe\xff" or (not marked and re.fullmatch(rb"\0[\t-~]\0[\t-~]", start) is not None)
        if not marked and not big and not re.fullmatch(rb"[\t-~]\0[\t-~]\0", start):
            return
        text = self.data[self.offset + (2 if marked else 0):]
        if len(text) % 2:
            raise malformed("the file ends inside a character (UTF-16 text)")
        self.data = text.decode("utf-16-be" if big else "utf-16-le", "replace").encode("utf-8", "replace")
        self.offset = 0
        self._recoded = True

    def read_line(self) -> Optional[str]:
        """The next line without its end, a letter for each byte. A last one of zero bytes or Ctrl-Z is none."""
        found = _LINE_END.search(self.data, self.offset)
        begin, end = self.offset, found.start() if found else len(self.data)
        self.offset = found.end() if found else end
        if found is None and _FILE_END.fullmatch(self.data, begin):
            return None
        self._line_ends = (found[0] if found else b"", self._line_ends[0])
        self.line_number += 1
        return self.data[begin:end].decode("latin-1")

    def begin_binary(self) -> None:
        """To be called before binary data. Of lines that end in CR alone, a line feed after the last is data."""
        if self._recoded:
            raise malformed("binary data cannot follow a header in UTF-16")
        if self._line_ends == (b"\r\n", b"\r"):
            self.offset -= 1

    def only_padding_left(self) -> bool:
        """Nothing is left but zero bytes (some writers pad) and perhaps a line end or two (editors add them)."""
        rest = self.data[self.offset:]
        shown = rest.replace(b"\0", b"")
        if len(shown) <= _MOST_BLANKS_OF_PADDING and not shown.strip(b" \t\r\v\f\n"):
            return True
        blanks = 0
        for match in re.finditer(rb"[^\0]", rest):
            blanks += 1
            if match[0] not in b" \t\r\v\f\n" or blanks > _MOST_BLANKS_OF_PADDING:
                self.offset += match.start()
                return False
        return True

    def content_lines_left(self) -> Optional[int]:
        """Lines from here on that are not blank; None if the file goes on beyond 1 MiB."""
        if self.remaining >= _LONG_FILE:
            return None
        return sum(1 for line in re.split(rb"[\r\n]", self.data[self.offset:]) if line.strip(b" \t\v\f"))

    def regular_rows(self, count: int, width: Optional[int] = None, least: int = 3,
                     whole: bool = False) -> List[npt.NDArray[np.float64]]:
        """As many of the next `count` lines as are plain numbers, `width` of them (None: as the first, at least `least`)
        on each, and no others than 0, 1, 2, ... if `whole`. The way for almost all files; what is left is read word by word, which also tells what is wrong."""
        blocks = []
        while count > 0:
            block = self._regular_block(min(count, _ROWS_AT_ONCE), width, least, _COUNTS if whole else _NUMBERS)
            if block is None:
                break
            blocks.append(block)
            count -= len(block)
            width = block.shape[1]
        return blocks

    def _regular_block(self, count: int, width: Optional[int], least: int,
                       letters: Pattern[bytes]) -> Optional[npt.NDArray[np.float64]]:
        end = self.offset
        for _ in range(count):
            line_end = self.data.find(b"\n", end)
            if line_end < 0:
                break
            end = line_end + 1
        text = self.data[self.offset:end]
        if not letters.fullmatch(text) or text.count(b"\r") != text.count(b"\r\n"):
            return None
        rows = [line.split() for line in text.split(b"\n")[:-1]]
        if not rows:
            return None
        width = width or max(len(rows[0]), least)
        if any(len(row) != width for row in rows):
            return None
        try:
            table = np.array(rows, dtype="S").astype(np.float64)
        except ValueError:
            return None
        if not np.isfinite(table).all():
            return None
        self.offset = end
        self.line_number += len(rows)
        return table

    def at_line(self, what: str, line: Optional[int] = None) -> InvalidInput:
        number = self.line_number if line is None else line
        return malformed("the file is empty" if number == 0 else f"line {number}: {what}")

    def at_byte(self, offset: int, what: str) -> InvalidInput:
        return malformed(f"byte {offset}: {what}")

    def after_last_line(self, what: str) -> InvalidInput:
        return malformed(f"the file ends after line {self.line_number}: {what}")


class WordReader:
    """The words of a text file, over the ends of lines."""

    def __init__(self, file: ScanBytes, skipped: Sequence[str] = ()) -> None:
        """Lines that begin with a word of `skipped` are skipped: "comment" in PLY."""
        self._file = file
        self._skipped = frozenset(skipped)
        self._words: List[str] = []
        self._at = 0
        self.ended = False
        """There was no line left."""

    def next_line(self) -> bool:
        """Drops the rest of the line and goes to the next that has a word; False at the end of the file."""
        self._at = 0
        while True:
            line = self._file.read_line()
            if line is None:
                self._words = []
                self.ended = True
                return False
            self._words = words_of(without_comment(line))
            if self._words and self._words[0].lower() not in self._skipped:
                return True

    def end_line(self) -> None:
        self._at = len(self._words)

    def at_line_end(self) -> bool:
        return self._at == len(self._words)

    def words_on_line(self) -> List[str]:
        """Those left, which stay there."""
        return self._words[self._at:]

    def next(self) -> str:
        """The next word of this line or a later one; empty at the end of the file."""
        if self._at == len(self._words) and not self.next_line():
            return ""
        return self.next_on_line()

    def next_on_line(self) -> str:
        if self._at == len(self._words):
            return ""
        self._at += 1
        return self._words[self._at - 1]

    def has_fewer_lines_than(self, records: int) -> bool:
        """One record a line is what every writer does, but line ends are no more than blanks to the formats: a file that
        has fewer lines left than records is read word by word. Unknown in a long file: False."""
        left = self._file.content_lines_left()
        return left is not None and (0 if self.at_line_end() else 1) + left < records
