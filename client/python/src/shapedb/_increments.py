# SPDX-License-Identifier: Apache-2.0
"""Increments of backups (docs/backup-format.md): which backup a file is, and what comes of a chain of files."""

from __future__ import annotations

import hashlib
import os
import struct
from bisect import bisect_right
from dataclasses import dataclass
from typing import BinaryIO, Iterator, List, Sequence, Tuple

from ._errors import InvalidInput, ShapeDBError

_PAGE = 4096
_MOST_BLOCKS = 65536
_LARGEST_BLOCK = 256 << 20
_PREFIX = struct.Struct("<8sIIQ32sQ32sQ")
MAGIC = b"ShDBincr"
"""How increments begin."""
_DATABASE = b"SQLite format 3\0"

Identity = Tuple[int, bytes]
"""Bytes and SHA-256 of a whole backup."""


@dataclass(frozen=True)
class Manifest:
    """A backup by the hashes of its blocks."""

    backup: Identity
    block_bytes: int
    hashes: bytes
    """32 bytes for each block."""


@dataclass(frozen=True)
class Head:
    """The beginning of an increment."""

    base: Identity
    result: Manifest
    changed: Tuple[int, ...]
    """Numbers of the blocks that it brings, ascending."""
    data_at: int
    """Where they begin in the file."""


def open_file(path: str) -> BinaryIO:
    """Of a backup. Raises file_not_readable."""
    try:
        return open(path, "rb")
    except OSError as error:
        raise ShapeDBError("file_not_readable", f"{path} cannot be read: {error.strerror}") from None


def _malformed(path: str, what: str) -> InvalidInput:
    return InvalidInput("malformed_file", f"'{path}' {what}")


def manifest_of(path: str) -> Manifest:
    """Of a full backup, or of what comes of an increment. Raises file_not_readable, malformed_file."""
    with open_file(path) as file:
        if file.read(len(MAGIC)) == MAGIC:
            return _head_of(path, file).result
        return _manifest_of_full(path, file, 0)


def _manifest_of_full(path: str, file: BinaryIO, block_bytes: int) -> Manifest:
    """In blocks of this size; 0: the smallest that it may have."""
    size = os.fstat(file.fileno()).st_size
    file.seek(0)
    if file.read(len(_DATABASE)) != _DATABASE:
        raise _malformed(path, "is neither a backup nor an increment of one")
    block = block_bytes or _PAGE
    while not block_bytes and block < _LARGEST_BLOCK and size > block * _MOST_BLOCKS:
        block *= 2
    if size % _PAGE or size > block * _MOST_BLOCKS:
        raise _malformed(path, f"is not a whole backup: it has {size} bytes")
    file.seek(0)
    whole = hashlib.sha256()
    hashes = []
    pages: List[bytes] = []
    for at in range(0, size, _PAGE):
        page = file.read(_PAGE)
        whole.update(page)
        pages.append(hashlib.sha256(page).digest())
        if (at + _PAGE) % block == 0 or at + _PAGE == size:
            hashes.append(_joined(pages))
            pages = []
    return Manifest((size, whole.digest()), block, b"".join(hashes))


def _joined(hashes: List[bytes]) -> bytes:
    """Pairs become one until one is left; the last of an odd number goes up as it is."""
    while len(hashes) > 1:
        pairs = [hashlib.sha256(hashes[i] + hashes[i + 1]).digest() for i in range(0, len(hashes) - 1, 2)]
        hashes = pairs + hashes[len(hashes) // 2 * 2:]
    return hashes[0]


def _head_of(path: str, file: BinaryIO) -> Head:
    size = os.fstat(file.fileno()).st_size
    file.seek(0)
    prefix = file.read(_PREFIX.size)
    if len(prefix) < _PREFIX.size or not prefix.startswith(MAGIC):
        raise _malformed(path, "is no increment")
    _, version, count, base_bytes, base_sum, bytes_, sum_, block = _PREFIX.unpack(prefix)
    if version != 1:
        raise _malformed(path, f"is an increment of version {version}, this package reads 1: update it")
    power = block >= _PAGE and block <= _LARGEST_BLOCK and block & (block - 1) == 0
    blocks = -(-bytes_ // block) if power else 0
    rest = 32 * blocks + 4 * count + 32
    if not power or blocks > _MOST_BLOCKS or count > blocks or size < _PREFIX.size + rest:
        raise _malformed(path, "is damaged: its beginning cannot be")
    data = file.read(rest)
    if len(data) != rest or hashlib.sha256(prefix + data[:-32]).digest() != data[-32:]:
        raise _malformed(path, "is damaged: its beginning has another checksum")
    changed = struct.unpack(f"<{count}I", data[32 * blocks:-32])
    head = Head((base_bytes, base_sum), Manifest((bytes_, sum_), block, data[:32 * blocks]), changed,
                _PREFIX.size + rest)
    whole = head.data_at + sum(min(block, bytes_ - number * block) for number in changed)
    if any(a >= b for a, b in zip(changed, changed[1:])) or any(number >= blocks for number in changed) or whole != size:
        raise _malformed(path, f"is damaged: it has {size} bytes instead of {whole}")
    return head


class Chain:
    """A full backup and its increments, oldest first, as the one backup that comes of them."""

    def __init__(self, paths: Sequence[str]) -> None:
        """Raises file_not_readable, malformed_file; invalid_argument if one does not follow the one before it,
        checksum_mismatch if the full backup is damaged or another one."""
        if not paths:
            raise InvalidInput("invalid_argument", "name the file of a full backup")
        self._paths = list(paths)
        self._heads: List[Head] = []
        with open_file(paths[0]) as full:
            self.bytes = os.fstat(full.fileno()).st_size
            if self.bytes == 0:
                raise ShapeDBError("file_not_readable", f"{paths[0]} is empty, not a backup")
            if full.read(len(MAGIC)) == MAGIC:
                raise InvalidInput("invalid_argument", f"'{paths[0]}' is an increment: name the full backup that it "
                                   "belongs to first")
            for path in paths[1:]:
                with open_file(path) as file:
                    self._append(path, _head_of(path, file))
            if self._heads:
                first = self._heads[0]
                found = _manifest_of_full(paths[0], full, first.result.block_bytes).backup
                if found != first.base:
                    raise ShapeDBError("checksum_mismatch", f"'{paths[0]}' is damaged, or not the backup that "
                                       f"'{paths[1]}' continues")
                self.bytes = self._heads[-1].result.backup[0]

    def _append(self, path: str, head: Head) -> None:
        if self._heads:
            before = self._heads[-1].result
            if head.base != before.backup:
                raise InvalidInput("invalid_argument", f"'{path}' does not follow '{self._paths[len(self._heads)]}': it "
                                   "continues another backup")
            if head.result.block_bytes < before.block_bytes:
                raise _malformed(path, "has smaller blocks than the increment before it")
        self._heads.append(head)

    def pieces(self, most: int) -> Iterator[bytes]:
        """Its bytes from the beginning, at most so many at a time. Raises checksum_mismatch if they are not those that
        the last increment names."""
        files = [open_file(path) for path in self._paths]
        try:
            whole = hashlib.sha256()
            position = 0
            while position < self.bytes:
                # Never beyond the announced size, even if a file grows meanwhile.
                piece = self._piece(files, position, min(most, self.bytes - position))
                if not piece:
                    raise ShapeDBError("file_not_readable", f"{self._paths[0]} became shorter while it was read")
                whole.update(piece)
                position += len(piece)
                if position == self.bytes and self._heads and whole.digest() != self._heads[-1].result.backup[1]:
                    raise ShapeDBError("checksum_mismatch", f"the files from '{self._paths[0]}' on do not give the backup "
                                       "that they should")
                yield piece
        finally:
            for file in files:
                file.close()

    def _piece(self, files: Sequence[BinaryIO], position: int, most: int) -> bytes:
        """From the newest increment that brings this place, or else as it is in the full backup."""
        end = position + most
        for head, file in zip(reversed(self._heads), reversed(files)):
            block = head.result.block_bytes
            number = position // block
            at = bisect_right(head.changed, number) - 1
            if at >= 0 and head.changed[at] == number:
                # All blocks before the last are whole.
                file.seek(head.data_at + at * block + position % block)
                return file.read(min(end, (number + 1) * block) - position)
            if at + 1 < len(head.changed):
                end = min(end, head.changed[at + 1] * block)
        files[0].seek(position)
        return files[0].read(end - position)
