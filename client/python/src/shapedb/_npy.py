# SPDX-License-Identifier: Apache-2.0
"""Arrays as numpy saves them."""

from __future__ import annotations

import io
import math
from typing import Any

import numpy as np

from ._scan_bytes import ScanBytes
from ._scan_content import Content
from ._scan_words import malformed

# Its functions are not typed.
_format: Any = np.lib.format
_MAGIC = b"\x93NUMPY"


def read_npy(file: ScanBytes) -> Content:
    """Its first three columns."""
    if file.peek(len(_MAGIC)) != _MAGIC:
        raise malformed("this is not a file of one array, as numpy.save writes")
    stream = io.BytesIO(file.data)
    try:
        version = _format.read_magic(stream)
        read_header = _format.read_array_header_1_0 if version == (1, 0) else _format.read_array_header_2_0
        shape, _, dtype = read_header(stream)
    except Exception:  # the header is text of Python: numpy raises whatever parsing it raises
        raise malformed("the header of the array is damaged") from None
    if len(shape) != 2 or shape[1] < 3 or dtype.kind not in "fiu":
        raise malformed("it must hold one array of numbers with three columns or more")
    if math.prod(shape) * dtype.itemsize > file.remaining - stream.tell():
        raise malformed(f"the header announces {shape[0]} points, but the file is too short for them")
    stream.seek(0)
    content = Content()
    array = np.load(stream, allow_pickle=False)
    content.add_vertices(array[:, :3].astype(np.float64), lambda i: f"row {i}")
    return content
