# SPDX-License-Identifier: Apache-2.0
"""Vectors of messages. Points travel relative to an origin near them, in the header of their scan, for a float32 holds
a shape far from 0 no better than its place; all that the server returns is in the coordinates of the scans themselves.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ._points import FloatArray


def fill_vector(message: Any, vector: FloatArray) -> None:
    """Writes a `Vector3`."""
    message.x, message.y, message.z = (float(component) for component in vector)


def vector_of(message: Any) -> FloatArray:
    """Reads a `Vector3`."""
    return np.array([message.x, message.y, message.z])


def send_origin(header: Any, origin: FloatArray, field: str = "origin") -> None:
    """Puts the origin of a scan into its header."""
    if origin.any():
        fill_vector(getattr(header, field), origin)
