# SPDX-License-Identifier: Apache-2.0
"""Scans as they come and as they are sent: arrays of points, packed to little-endian float32."""

from __future__ import annotations

import hashlib
import os
from dataclasses import dataclass
from typing import Any, Iterator, Protocol, Union

import numpy as np
import numpy.typing as npt

from ._errors import InvalidInput
from ._resolution import origin_of, size_of

FloatArray = npt.NDArray[np.float64]


class HasPoints(Protocol):
    """A point cloud of Open3D or PyVista, for example."""

    @property
    def points(self) -> Any:
        """What numpy makes an (n, 3) array of."""


class HasVertices(Protocol):
    """A mesh of trimesh (`.faces`) or Open3D (`.triangles`), for example."""

    @property
    def vertices(self) -> Any:
        """What numpy makes an (n, 3) array of."""


Scan = Union[npt.ArrayLike, "os.PathLike[str]", str, HasPoints, HasVertices]
"""What is taken for a scan: an (n, 3) array or what numpy makes one of, the path of a file, an object with `.points`
(Open3D, PyVista), or a mesh with `.vertices` and `.faces` or `.triangles` (trimesh, Open3D)."""

CHUNK_BYTES = (1 << 20) // 12 * 12
"""Whole points that fit into the most a chunk may have."""

_LARGEST = float(np.finfo(np.float32).max)
# Below this diagonal float32 loses detail to subnormals: 2^24 times the smallest normal number.
_SMALLEST_DIAGONAL = float(np.finfo(np.float32).tiny) * 2.0**24


def as_points(scan: Scan) -> FloatArray:
    """The points of a scan as a new or shared (n, 3) array of float64.

    Raises `InvalidInput` for what is no scan, has no points, or has a coordinate that is NaN, infinite or beyond
    single precision; the message names the first such point. Files and meshes: see `shapedb.read_scan`.
    """
    if isinstance(scan, (str, os.PathLike)):
        from ._files import read_scan
        return _checked(read_scan(scan))
    if not isinstance(scan, np.ndarray):
        if hasattr(scan, "points"):
            scan = scan.points
        elif hasattr(scan, "vertices"):
            from ._mesh import points_of_mesh
            return _checked(points_of_mesh(*_mesh_arrays(scan)))
    return _checked(_array(scan))


def _mesh_arrays(mesh: Any) -> tuple[FloatArray, npt.NDArray[np.int64]]:
    faces = getattr(mesh, "faces", getattr(mesh, "triangles", ()))
    triangles = np.asarray(faces, dtype=np.int64)
    if triangles.size == 0:
        triangles = np.zeros((0, 3), dtype=np.int64)
    return _array(mesh.vertices), triangles


def _array(scan: Any) -> FloatArray:
    try:
        array = np.asarray(scan)
    except ValueError as error:
        raise InvalidInput("invalid_argument", f"the scan is not an (n, 3) array: {error}") from None
    if array.dtype.kind not in "fiu":
        what = type(scan).__name__ if array.dtype.kind == "O" else f"an array of {array.dtype}"
        raise InvalidInput("invalid_argument",
                           f"a scan is an (n, 3) array of numbers, a path, or an object with .points; this is {what}")
    if array.size == 0:
        raise InvalidInput("too_few_points", "the scan has no points; a shape needs at least 4")
    if array.ndim != 2 or array.shape[1] != 3:
        hint = "; its transpose would be one" if array.ndim == 2 and array.shape[0] == 3 else ""
        raise InvalidInput("invalid_argument", f"the scan has shape {array.shape}; it must be (n, 3){hint}")
    return np.asarray(array, dtype=np.float64)


def _checked(points: FloatArray) -> FloatArray:
    _refuse(points, ~np.isfinite(points), "non_finite_coordinate", "; remove such points before sending the scan")
    _refuse(points, np.abs(points) > _LARGEST, "coordinate_out_of_range",
            ", beyond single precision (3.4e38); use a larger unit")
    return points


def _refuse(points: FloatArray, bad: npt.NDArray[np.bool_], reason: str, advice: str) -> None:
    if bad.any():
        first = int(np.argmax(bad.any(axis=1)))
        x, y, z = points[first]
        raise InvalidInput(reason, f"point {first} is ({x:g}, {y:g}, {z:g}){advice}")


@dataclass(frozen=True, eq=False)
class Packed:
    """A scan as it is sent."""

    data: bytes
    """Little-endian float32 x y z of every point, relative to `origin`."""
    count: int
    sha256: bytes
    origin: FloatArray
    """What was subtracted from every point: zero, unless the scan lies far from there."""

    def chunks(self) -> Iterator[bytes]:
        """The data in pieces that may be sent."""
        for at in range(0, len(self.data), CHUNK_BYTES):
            yield self.data[at:at + CHUNK_BYTES]


def pack(scan: Scan) -> Packed:
    """Checks and packs a scan. If it lies so far from the origin that single precision would hurt its shape, the
    centre of its box, without outliers, is subtracted first, in double precision."""
    points = as_points(scan)
    diagonal = size_of(points.min(axis=0), points.max(axis=0))
    if 0.0 < diagonal < _SMALLEST_DIAGONAL:
        raise InvalidInput(
            "coordinate_out_of_range", f"the whole scan is only {diagonal:g} across, too small for single precision "
            f"({_SMALLEST_DIAGONAL:.2g}); use a smaller unit")
    origin = origin_of(points)
    if np.abs(points - origin).max() > _LARGEST:
        raise InvalidInput("coordinate_out_of_range",
                           "a point lies too far from most others for single precision (3.4e38); drop it")
    data = np.ascontiguousarray(points - origin, dtype="<f4").tobytes()
    return Packed(data, len(points), hashlib.sha256(data).digest(), origin)


def unpack(data: bytes, origin: FloatArray) -> FloatArray:
    """The points of packed data in the coordinates of their scan."""
    return np.frombuffer(data, dtype="<f4").reshape(-1, 3).astype(np.float64) + origin


def text_of(value: Any, what: str) -> str:
    """Text that can be sent. Raises `InvalidInput` for what is no text, or is not UTF-8, as names of files may be."""
    if not isinstance(value, str):
        raise InvalidInput("invalid_argument", f"{what} is {value!r:.60}; it must be text")
    try:
        value.encode()
    except UnicodeEncodeError:
        raise InvalidInput("invalid_argument", f"{what} {value!r:.60} is not UTF-8") from None
    return value


def read_only(array: Any) -> FloatArray:
    """A copy that refuses changes, for values that are shared."""
    copy = np.array(array, dtype=np.float64)
    copy.flags.writeable = False
    return copy
