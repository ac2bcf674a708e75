# SPDX-License-Identifier: Apache-2.0
"""Files packed by gzip, as client/io/byte_source.cpp unpacks them."""

from __future__ import annotations

import zlib

from ._scan_words import malformed

# Scans as text shrink to a third, those of few different numbers to a twentieth.
_GREATEST_PACKING_RATIO = 200
_ALWAYS_UNPACKED_BYTES = 64 << 20
_AT_ONCE = 1 << 20
_GZIP_WINDOW = 15 + 16  # the largest window, with the header of gzip


def is_packed(data: bytes) -> bool:
    return data[:3] == b"\x1f\x8b\x08"


def gunzip(packed: bytes) -> bytes:
    """Several members are one file. Raises `InvalidInput`."""
    out = bytearray()
    rest = packed
    while True:
        rest = _member(rest, out, len(packed))
        # After a member comes the next one, the end, or zero bytes up to it.
        shown = rest.lstrip(b"\0")
        if not shown:
            return bytes(out)
        if len(shown) < len(rest) or rest[0] != 0x1f:
            raise malformed("data after the gzip data")


def _member(data: bytes, out: bytearray, packed_size: int) -> bytes:
    """Returns what follows it."""
    stream = zlib.decompressobj(_GZIP_WINDOW)
    while not stream.eof:
        try:
            piece = stream.decompress(data, _AT_ONCE)
        except zlib.error:
            raise malformed("the gzip data is damaged") from None
        data = stream.unconsumed_tail
        out += piece
        if not piece and not data and not stream.eof:
            raise malformed("the gzip data is cut short")
        if len(out) > _ALWAYS_UNPACKED_BYTES and len(out) / _GREATEST_PACKING_RATIO > packed_size:
            raise malformed(f"more than {_GREATEST_PACKING_RATIO} times as large when unpacked, which is not read from packed "
                            "files; if it is meant to be, unpack it first, e.g. with gunzip")
    return stream.unused_data
