# SPDX-License-Identifier: Apache-2.0
"""What a file is by how it begins, as client/io/kind_of_content.h has it. Asked only after a reader has refused the file:
nothing that is read depends on it."""

from __future__ import annotations

import re
from typing import List

from ._scan_words import integer_of, real_of, without_comment, words_of

NAMES = {
    ".ply": "a PLY file", ".pcd": "a PCD file", ".off": "an OFF file", ".obj": "an OBJ file", ".stl": "an STL file",
    ".las": "a LAS file", ".gltf": "a glTF file", ".glb": "a glTF file", ".3mf": "a 3MF file", ".npy": "an array of NumPy",
    ".xyz": "text with a point on each line",
}
"""For messages; of a format with several endings, the first of them."""

_MAGIC = ((b"LASF", ".las"), (b"glTF", ".glb"), (b"\x93NUMPY", ".npy"))
_HEAD_BYTES = 1 << 16
_OFF = re.compile(r"(st)?c?n?4?n?off *(binary|[0-9].*)?", re.IGNORECASE)
_OBJ_WORDS = ("v", "vn", "vt", "vp", "f", "l", "p", "o", "g", "s", "mtllib", "usemtl")
_STL_HEADER, _STL_TRIANGLE = 84, 50


def ending_of_content(data: bytes) -> str:
    """The ending that the file should have, as in NAMES; empty if it begins like none of these."""
    head = data[:_HEAD_BYTES]
    for magic, ending in _MAGIC:
        if head.startswith(magic):
            return ending
    if head.startswith(b"PK\x03\x04"):
        return ".3mf" if b"3D/3dmodel.model" in head else ""
    return _ending_of_text(_text_of(head)) or (".stl" if _has_size_of_stl(data) else "")


def has_text_for_binary(data: bytes) -> bool:
    """The header of a PLY or PCD file announces binary data, and text follows."""
    head = data[:_HEAD_BYTES].lower()
    header = re.match(rb"(.*?format binary.*?end_header|.*?[\r\n]data binary\w*)[ \t]*\r?\n?", head, re.DOTALL)
    body = head[header.end():][:1024] if header else b""
    return re.fullmatch(rb"[\t-\r -~]{12,}", body) is not None and re.search(rb"[0-9]", body) is not None


def _text_of(head: bytes) -> str:
    """A letter for each byte, without what marks UTF-8 and UTF-16."""
    marked = re.sub(rb"^(\xef\xbb\xbf|\xff\xfe|\xfe\xff)", b"", head)
    return (marked.replace(b"\0", b"") if b"\0" in marked[:2] else marked).decode("latin-1")


def _ending_of_text(text: str) -> str:
    raw = re.split(r"[\r\n]+", text)
    lines = [words for words in (words_of(without_comment(line)) for line in raw) if words]
    if not lines:
        return ""
    first = lines[0][0].lower()
    if lines[0] == [lines[0][0]] and first == "ply":
        return ".ply"
    if first in ("version", "fields", "columns") and any(words[0].lower() in ("fields", "columns") for words in lines):
        return ".pcd"
    if _OFF.fullmatch(" ".join(lines[0])):
        return ".off"
    if first.startswith("solid") and re.search("facet|endsolid", text, re.IGNORECASE):
        return ".stl"
    if first.startswith("{") and '"asset"' in text:
        return ".gltf"
    if first in _OBJ_WORDS and any(words[0] == "v" and _begins_with_a_point(words[1:]) for words in lines):
        return ".obj"
    return ".xyz" if _is_text_of_points(raw) else ""


def _is_text_of_points(raw: List[str]) -> bool:
    """Three numbers on the first line that is no comment, after a count and the names of columns. Whole
    numbers may also be what OFF without its first word begins with."""
    lines = [words for words in (words_of(re.sub(r'[,;"]', " ", line)) for line in raw) if words and not re.match(r"[#%!]|//", words[0])]
    if lines and len(lines[0]) == 1 and integer_of(lines[0][0]) is not None:
        lines = lines[1:]
    if lines and {"x", "y", "z"} <= {re.split(r"[\[(]", word)[0].lower() for word in lines[0]}:
        lines = lines[1:]
    return bool(lines) and _begins_with_a_point(lines[0]) and any(integer_of(word) is None for word in lines[0][:3])


def _begins_with_a_point(words: List[str]) -> bool:
    return len(words) >= 3 and all(real_of(word) is not None for word in words[:3])


def _has_size_of_stl(data: bytes) -> bool:
    """Binary STL has no other mark."""
    count = int.from_bytes(data[_STL_HEADER - 4:_STL_HEADER], "little")
    return count > 0 and len(data) == _STL_HEADER + _STL_TRIANGLE * count
