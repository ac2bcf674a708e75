# SPDX-License-Identifier: Apache-2.0
"""Reads the scan files that are common among researchers. The `shapedb` command reads more of them."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Any, Callable, Dict, List, Optional, Sequence, Tuple

import numpy as np
import numpy.typing as npt

from ._connection import PathLike
from ._errors import InvalidInput, ShapeDBError
from ._mesh import SAMPLES, points_of_mesh
from ._points import FloatArray
from ._ply import read_ply

Triangles = npt.NDArray[np.int64]
_NO_TRIANGLES: Triangles = np.zeros((0, 3), dtype=np.int64)


def read_scan(path: PathLike, *, mesh_samples: int = SAMPLES, seed: int = 1) -> FloatArray:
    """The points of a scan file as an (n, 3) array: .ply, .stl, .obj, .xyz, .txt, .pts, .asc, .npy.

    Of a file with triangles, `mesh_samples` points of its surface, unless the vertices are what was measured: the rule
    is that of `shapedb add` (docs/file-formats.md), the points are not. Raises `ShapeDBError` with file_not_readable,
    unknown_file_format or malformed_file. For other formats use trimesh or Open3D, whose objects are scans too.
    """
    name = os.fspath(path)
    reader = _READERS.get(Path(name).suffix.lower())
    if reader is None:
        raise InvalidInput("unknown_file_format",
                           f"{name}: this package reads {', '.join(sorted(ENDINGS))}; load other formats with trimesh "
                           "or Open3D and give the object, or use `shapedb add`")
    if mesh_samples < 1:
        raise InvalidInput("invalid_argument", f"mesh_samples is {mesh_samples}; it must be at least 1")
    try:
        data = Path(name).read_bytes()
    except OSError as error:
        raise ShapeDBError("file_not_readable", f"{name}: cannot be read: {error.strerror or error}") from None
    if not data:
        raise InvalidInput("malformed_file", f"{name}: the file is empty")
    try:
        vertices, triangles = reader(data)
        points = points_of_mesh(vertices, triangles, mesh_samples, seed)
        if len(points) == 0:
            raise InvalidInput("malformed_file", "there are no points in the file")
        return points
    except InvalidInput as error:
        raise InvalidInput(error.reason, f"{name}: {error.message}") from None
    except (ValueError, IndexError, OverflowError) as error:
        raise InvalidInput("malformed_file", f"{name}: {error}") from None


def _text(data: bytes) -> str:
    return data.decode("utf-8-sig", "replace")


def _read_table(data: bytes) -> Tuple[FloatArray, Triangles]:
    """Three numbers at the start of each line."""
    rows: List[Tuple[float, float, float]] = []
    announced: Optional[int] = None
    for number, line in enumerate(_text(data).splitlines(), 1):
        line = line.strip()
        if not line or line.startswith(("#", "//")):
            continue
        fields = re.split(r"[\s,;]+", line)
        if not rows and announced is None and len(fields) == 1 and fields[0].isdigit():
            announced = int(fields[0])
            continue
        if not rows and [field.lower() for field in fields[:3]] == ["x", "y", "z"]:
            continue
        if re.match(r"-?\d+,\d+\s+-?\d+,\d+", line):
            raise InvalidInput("malformed_file", f"line {number} has decimal commas; write decimal points")
        try:
            x, y, z = (float(field) for field in fields[:3])
        except ValueError:
            raise InvalidInput("malformed_file",
                               f"line {number}: expected three numbers, found '{line[:40]}'") from None
        rows.append((x, y, z))
    if announced is not None and announced != len(rows):
        raise InvalidInput("malformed_file", f"the first line announces {announced} points, there are {len(rows)}")
    return np.array(rows, dtype=np.float64).reshape(-1, 3), _NO_TRIANGLES


def _read_npy(data: bytes) -> Tuple[FloatArray, Triangles]:
    import io
    array = np.load(io.BytesIO(data), allow_pickle=False)
    if not isinstance(array, np.ndarray) or array.ndim != 2 or array.shape[1] < 3 or array.dtype.kind not in "fiu":
        raise InvalidInput("malformed_file", "it must hold one array of numbers with three columns or more")
    return array[:, :3].astype(np.float64), _NO_TRIANGLES


def _fan(polygon: Sequence[int]) -> List[Tuple[int, int, int]]:
    return [(polygon[0], polygon[i], polygon[i + 1]) for i in range(1, len(polygon) - 1)]


def _read_obj(data: bytes) -> Tuple[FloatArray, Triangles]:
    vertices: List[List[float]] = []
    polygons: List[List[int]] = []
    for number, line in enumerate(_text(data).replace("\\\n", " ").splitlines(), 1):
        fields = line.split()
        if not fields or fields[0] not in ("v", "f"):
            continue
        try:
            if fields[0] == "v":
                x, y, z = (float(field) for field in fields[1:4])
                vertices.append([x, y, z])
            else:
                corners = [int(field.split("/")[0]) for field in fields[1:]]
                # Counted from 1; negative ones from the last vertex so far.
                polygons.append([corner - 1 if corner > 0 else len(vertices) + corner for corner in corners])
        except ValueError:
            raise InvalidInput("malformed_file", f"line {number}: expected numbers, found '{line[:40]}'") from None
    if not vertices:
        raise InvalidInput("malformed_file", "it has no 'v' line")
    triangles = [triangle for polygon in polygons for triangle in _fan(polygon)]
    return np.array(vertices, dtype=np.float64), np.array(triangles, dtype=np.int64).reshape(-1, 3)


_STL_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])


def _read_stl(data: bytes) -> Tuple[FloatArray, Triangles]:
    count = int.from_bytes(data[80:84], "little") if len(data) >= 84 else -1
    if count >= 0 and len(data) == 84 + 50 * count:
        corners = np.frombuffer(data, _STL_RECORD, count, 84)["corners"].astype(np.float64).reshape(-1, 3)
    elif data.lstrip().startswith(b"solid"):
        found = re.findall(r"^\s*vertex\s+(\S+)\s+(\S+)\s+(\S+)\s*$", _text(data), flags=re.MULTILINE)
        corners = np.array(found, dtype=np.float64).reshape(-1, 3)
        if "endsolid" not in _text(data) or len(corners) % 3 != 0:
            raise InvalidInput("malformed_file", "it ends in the middle of a solid")
    else:
        raise InvalidInput("malformed_file", "it is neither ASCII STL nor of the size that its binary header announces")
    if len(corners) == 0:
        raise InvalidInput("malformed_file", "it has no triangle")
    vertices, index = np.unique(corners, axis=0, return_inverse=True)
    return vertices, np.asarray(index, dtype=np.int64).reshape(-1, 3)


_READERS: Dict[str, Callable[[bytes], Tuple[Any, Triangles]]] = {
    ".ply": read_ply, ".stl": _read_stl, ".obj": _read_obj, ".npy": _read_npy,
    ".xyz": _read_table, ".txt": _read_table, ".pts": _read_table, ".asc": _read_table,
}

ENDINGS = frozenset(_READERS)
"""Of the files that `read_scan` reads."""
