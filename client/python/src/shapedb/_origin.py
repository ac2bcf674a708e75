"""Where a scan lies: everything that the server returns is given in the coordinates of the scans themselves.

Points travel relative to an origin near them (`Packed.origin`). A server whose API has origins adds them to all that
it returns. With an earlier one the client keeps the origin in the metadata `shapedb.offset` and adds it here. This is
the only module that knows the difference.
"""

from __future__ import annotations

from typing import Any, Mapping, Optional

import numpy as np

from shapedb.v1 import shape_service_pb2 as shape_pb

from ._errors import ShapeDBError
from ._points import FloatArray

OFFSET_KEY = "shapedb.offset"
"""Metadata that describes the points; not shown to callers."""

NATIVE = "origin" in shape_pb.AddShapeHeader.DESCRIPTOR.fields_by_name
"""Whether the API has origins."""

ZERO = np.zeros(3)


def fill_vector(message: Any, vector: FloatArray) -> None:
    """Writes a `Vector3`."""
    message.x, message.y, message.z = (float(component) for component in vector)


def vector_of(message: Any) -> FloatArray:
    """Reads a `Vector3`."""
    return np.array([message.x, message.y, message.z])


def send(header: Any, origin: FloatArray, field: str = "origin") -> None:
    """Puts the origin of a scan into its header."""
    if NATIVE and origin.any():
        fill_vector(getattr(header, field), origin)


def send_with_metadata(header: Any, origin: FloatArray, metadata: Optional[Mapping[str, str]]) -> None:
    """Puts origin and metadata into the header of a shape. None: a shape that has the key keeps its metadata."""
    send(header, origin)
    offset = {} if NATIVE or not origin.any() else {OFFSET_KEY: " ".join(repr(float(x)) for x in origin)}
    if metadata is not None and (metadata or offset):
        header.metadata.update({**metadata, **offset})
        return
    change = header.metadata_change
    change.SetInParent()
    change.replace_all = metadata is not None
    change.set.update(offset)
    if not NATIVE and metadata is None and not offset:
        change.remove.append(OFFSET_KEY)  # of points that are replaced


def of_shape(shape: Any) -> FloatArray:
    """What the stored points of a shape are relative to."""
    if NATIVE:
        return vector_of(shape.origin)
    text = shape.metadata[OFFSET_KEY] if OFFSET_KEY in shape.metadata else "0 0 0"
    try:
        origin = np.array([float(number) for number in text.split()])
    except ValueError:
        origin = np.array([])
    if origin.shape != (3,) or not np.isfinite(origin).all():
        raise ShapeDBError("data_loss", f"metadata {OFFSET_KEY}: '{text}' is not three numbers")
    return origin


def same(shape: Any, origin: FloatArray) -> bool:
    """Whether a stored shape has this origin."""
    return bool(np.array_equal(of_shape(shape), origin))


def moved(query: FloatArray) -> FloatArray:
    """By how much positions of a query that was sent with this origin are to be moved."""
    return ZERO if NATIVE else query


def moved_shape(shape: Any) -> FloatArray:
    """By how much positions of a stored shape are to be moved."""
    return ZERO if NATIVE else of_shape(shape)


def user_metadata(shape: Any) -> dict[str, str]:
    """The metadata of a shape without what is kept here."""
    return {key: value for key, value in sorted(shape.metadata.items()) if key != OFFSET_KEY}
