# SPDX-License-Identifier: Apache-2.0
"""Reads scan files by the rules of the `shapedb` command (docs/file-formats.md), which reads more of them. One set of
files holds both to each other (tests/support/file_cases/)."""

from __future__ import annotations

import os
import warnings
from pathlib import Path, PurePath
from typing import Callable, Dict, Optional

from ._connection import PathLike
from ._errors import InvalidInput, ShapeDBError
from ._gunzip import gunzip, is_packed
from ._kind_of_content import NAMES, ending_of_content, has_text_for_binary
from ._mesh import SAMPLES, points_of_mesh
from ._npy import read_npy
from ._obj import read_obj
from ._off import read_off
from ._pcd import read_pcd
from ._ply import read_ply
from ._points import FloatArray
from ._resolution import check_not_rounded
from ._scan_bytes import ScanBytes
from ._scan_content import Content
from ._scan_words import in_quotes, malformed
from ._stl import read_stl
from ._text_points import begins_with_a_point, read_text_points

_READERS: Dict[str, Callable[[ScanBytes], Content]] = {
    ".ply": read_ply, ".pcd": read_pcd, ".off": read_off, ".obj": read_obj, ".stl": read_stl, ".npy": read_npy,
    ".xyz": read_text_points, ".xyzn": read_text_points, ".xyzrgb": read_text_points, ".txt": read_text_points,
    ".pts": read_text_points, ".asc": read_text_points, ".csv": read_text_points,
}

ENDINGS = frozenset(_READERS)
"""Of the files that `read_scan` reads; .gz may follow."""

_BY_TRIMESH = 'trimesh.load(FILE, force="mesh")'
# What the command reads beside these, and who reads it in Python.
_OF_THE_COMMAND = {".las": "laspy.read(FILE).xyz", ".gltf": _BY_TRIMESH, ".glb": _BY_TRIMESH, ".3mf": _BY_TRIMESH}
_PACKED = ".gz"
_POINTER = b"version https://git-lfs.github.com/spec/"
_ARCHIVES = ((b"PK\x03\x04", "ZIP archive"), (b"BZh", "file packed by bzip2"), (b"\xfd7zXZ", "file packed by xz"),
             (b"\x28\xb5\x2f\xfd", "file packed by zstd"), (b"7z\xbc\xaf\x27\x1c", "7-Zip archive"))


def read_scan(path: PathLike, *, mesh_samples: int = SAMPLES, seed: int = 1) -> FloatArray:
    """The points of a scan file as an (n, 3) array: .ply, .pcd, .off, .obj, .stl, text (.xyz, .txt, .csv, ...) and .npy,
    packed by gzip or not.

    Of a file with triangles, `mesh_samples` points of its surface, unless the vertices are what was measured: the rule
    is that of `shapedb add` (docs/file-formats.md), the points are not. Points of a PCD file at which nothing was measured
    are left out. Warns of what may have been faces, but was not read as such. Raises `ShapeDBError` with
    file_not_readable, unknown_file_format, malformed_file, non_finite_coordinate or coordinate_out_of_range. For other
    formats use trimesh, Open3D or laspy, or `shapedb add`.
    """
    name = os.fspath(path)
    if mesh_samples < 1:
        raise InvalidInput("invalid_argument", f"mesh_samples is {mesh_samples}; it must be at least 1")
    content = read_content(name)
    if content.ignored:
        warnings.warn(f"{name}: passed over: {', '.join(content.ignored)}", stacklevel=2)
    try:
        points = points_of_mesh(content.vertices, content.triangles, mesh_samples, seed)
    except InvalidInput as error:
        raise InvalidInput(error.reason, f"{name}: {error.message}") from None
    if len(points) == 0:
        raise InvalidInput("malformed_file", f"{name}: there are no points in the file")
    return points


def read_content(name: str) -> Content:
    """What is in the file, before anything is made of it. Raises `ShapeDBError`."""
    _reader_of(name)  # a file that is not read is not opened
    try:
        data = Path(name).read_bytes()
    except (OSError, ValueError) as error:  # ValueError: a zero byte in the name
        why = error.strerror if isinstance(error, OSError) else None
        raise ShapeDBError("file_not_readable", f"{name}: cannot be read: {why or error}") from None
    return content_of(name, data)


def content_of(name: str, data: bytes) -> Content:
    """What is in the bytes of the file. Raises `ShapeDBError`."""
    reader = _reader_of(name)
    try:
        content = _read(reader, gunzip(data) if is_packed(data) else data)
        check_not_rounded(content.vertices)
        return content
    except InvalidInput as error:
        raise InvalidInput(error.reason, f"{name}: {error.message}") from None
    except MemoryError:
        raise ShapeDBError("out_of_memory", f"{name}: not enough memory to read the file") from None
    except Exception as error:  # a fault of ours, which a strange file must not turn into one of the caller's
        raise ShapeDBError("internal", f"{name}: reading failed: {error}") from error


def _read(reader: Callable[[ScanBytes], Content], data: bytes) -> Content:
    try:
        _check_has_content(data)
        return reader(ScanBytes(data))
    except InvalidInput as error:
        raise _of_another_kind(reader, data) or error from None


def _of_another_kind(reader: Callable[[ScanBytes], Content], data: bytes) -> Optional[InvalidInput]:
    """What to say in place of the reader's complaint about a file that is not what its ending or its
    header says."""
    ending = ending_of_content(data)
    if not ending:
        return None
    if _READERS.get(ending) is reader:
        return malformed("the header announces binary data, but text follows: it should say 'ascii'") if has_text_for_binary(data) else None
    expected = next(name for name in _READERS if _READERS[name] is reader)
    elsewhere = "" if ending in _READERS else " (the command reads that, this package does not)"
    return malformed(f"this is {NAMES[ending]}, not {NAMES[expected]}: rename it to end in {ending}{elsewhere}")


def ending_of(path: "PurePath | str") -> str:
    """Of the format, in lower case: ".ply" of "scan.PLY" and of "scan.ply.gz"."""
    pure = PurePath(path)
    ending = pure.suffix.lower()
    return PurePath(pure.stem).suffix.lower() if ending == _PACKED else ending


def without_ending(path: Path) -> Path:
    """ "Hand/193.ply" and "Hand/193.ply.gz" -> "Hand/193"."""
    return (path.with_suffix("") if path.suffix.lower() == _PACKED else path).with_suffix("")


def is_scan_file(path: Path) -> bool:
    """Text and tables may be about anything: they count if their first line of content looks like a point."""
    if ending_of(path) not in ENDINGS:
        return False
    if ending_of(path) not in (".txt", ".csv"):
        return True
    try:
        data = path.read_bytes()
        return begins_with_a_point(gunzip(data) if is_packed(data) else data)
    except (OSError, ValueError):
        return False


def _reader_of(name: str) -> Callable[[ScanBytes], Content]:
    ending = ending_of(name)
    if ending in _READERS:
        return _READERS[ending]
    known = " ".join(_READERS)
    if ending in _OF_THE_COMMAND:
        raise InvalidInput("unknown_file_format",
                           f"{name}: this package does not read {ending}, but the command does: `shapedb add FILE` stores it. "
                           f"Or give {_OF_THE_COMMAND[ending]}. The package reads {known}")
    what = f"unknown file ending {in_quotes(ending)}" if ending else "no file ending"
    raise InvalidInput("unknown_file_format",
                       f"{name}: {what}; this package reads {known}, and .gz after that. Load other files with trimesh or "
                       "Open3D and give the object, or convert them (docs/file-formats.md, \"Other formats\")")


def _check_has_content(data: bytes) -> None:
    """What no reader can make anything of is named for what it is."""
    if data in (b"", b"\xef\xbb\xbf", b"\xff\xfe", b"\xfe\xff"):
        raise malformed("the file is empty")
    if data.startswith(_POINTER):
        raise malformed("this is a Git LFS pointer, not the file itself; fetch that with 'git lfs pull'")
    for start, archive in _ARCHIVES:
        if data.startswith(start):
            raise malformed(f"this is a {archive}; unpack it first")
