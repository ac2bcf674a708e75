# SPDX-License-Identifier: Apache-2.0
"""Scan files: what is read, and what is refused with which words."""

import re
import struct

import hypothesis.strategies as st
import numpy as np
import pytest
import shapedb
from hypothesis import given

import solids

POINTS = solids.ball(20).round(3)
# A cube of 8 vertices and 6 squares.
CORNERS = np.array([(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)], dtype=float)
SQUARES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]


def read(folder, name, content, **options):
    path = folder / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return shapedb.read_scan(path, **options)


def refusal(folder, name, content):
    with pytest.raises(shapedb.ShapeDBError) as error:
        read(folder, name, content)
    assert name in error.value.message
    return error.value


def ply(points, order, scalar="float", faces=None, extra=True):
    format_name = {"": "ascii", "<": "binary_little_endian", ">": "binary_big_endian"}[order]
    head = [f"ply\nformat {format_name} 1.0\ncomment made by a test\nelement vertex {len(points)}"]
    head += [f"property {scalar} {axis}" for axis in "xyz"] + (["property uchar red"] if extra else [])
    if faces is not None:
        head += [f"element face {len(faces)}", "property list uchar int vertex_indices"]
    body = b""
    for point in points:
        if order == "":
            body += (" ".join(repr(float(v)) for v in point) + (" 255" if extra else "") + "\n").encode()
        else:
            body += struct.pack(order + ("ddd" if scalar == "double" else "fff"), *point) + (b"\xff" if extra else b"")
    for face in faces or ():
        body += (f"{len(face)} " + " ".join(map(str, face)) + "\n").encode() if order == "" else \
            struct.pack(f"{order}B{len(face)}i", len(face), *face)
    return "\n".join(head + ["end_header\n"]).encode() + body


@pytest.mark.parametrize("order", ["", "<", ">"])
@pytest.mark.parametrize("scalar", ["float", "double"])
def test_ply_of_points(tmp_path, order, scalar):
    found = read(tmp_path, "scan.PLY", ply(POINTS, order, scalar))
    np.testing.assert_allclose(found, POINTS, atol=1e-7)


@pytest.mark.parametrize("order", ["", "<", ">"])
@pytest.mark.parametrize("faces", [SQUARES, SQUARES[:3] + [(2, 3, 7), (2, 7, 6)] + SQUARES[4:]])
def test_ply_of_a_mesh_is_sampled(tmp_path, order, faces):
    found = read(tmp_path, "cube.ply", ply(CORNERS, order, faces=faces), mesh_samples=3000)
    assert found.shape == (3000, 3)
    on_side = (np.isclose(found, 0) | np.isclose(found, 1))
    assert on_side.any(axis=1).all() and ((found > -1e-9) & (found < 1 + 1e-9)).all()
    shares = [np.isclose(found[:, axis], side).mean() for axis in range(3) for side in (0, 1)]
    assert max(shares) - min(shares) < 0.05


@given(st.binary(max_size=200), st.integers(0, 400))
def test_ply_of_anything_is_read_or_refused(tmp_path_factory, junk, cut):
    folder = tmp_path_factory.mktemp("junk")
    whole = ply(POINTS, "<", faces=[(0, 1, 2)])
    for content in (b"ply\n" + junk, whole[:cut], whole[:-40] + junk):
        try:
            shapedb.as_points(read(folder, "junk.ply", content))
        except shapedb.ShapeDBError as error:
            assert error.reason in ("malformed_file", "non_finite_coordinate", "coordinate_out_of_range",
                                    "too_few_points")


@pytest.mark.parametrize("content, words", [
    (b"plx\n", "line 1: expected 'ply'"), (b"ply\nformat ascii 1.0\n", "header"),
    (b"ply\nformat ascii 1.0\nelement vertex 1\nproperty real x\nend_header\n", "line 4: expected a type"),
    (b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nend_header\n1 2\n",
     "no property 'z'"),
    (ply(POINTS, "")[:-40], "vertex 18 of 20"), (ply(POINTS, "<")[:-4], "room for 19"),
    (ply(CORNERS, "<", faces=[(0, 1, 9)]), "face 0 of 1 names vertex 9"),
    (ply(CORNERS, "", faces=[(0, 1, -1)]), "face 0 of 1 names vertex -1"),
])
def test_bad_ply_is_refused(tmp_path, content, words):
    error = refusal(tmp_path, "bad.ply", content)
    assert error.reason == "malformed_file" and words in error.message, error.message


def test_text(tmp_path):
    rows = "\n".join(" ".join(map(str, point)) + " 7 8" for point in POINTS)
    for name, content in (("a.xyz", rows), ("b.txt", "# comment\nx y z\n" + rows.replace(" ", ", ")),
                          ("c.pts", f"{len(POINTS)}\n{rows}\n\n"), ("d.asc", "\ufeff" + rows.replace("\n", "\r\n"))):
        np.testing.assert_array_equal(read(tmp_path, name, content), POINTS)
    assert "line 2" in refusal(tmp_path, "bad.xyz", "1 2 3\n1 two 3\n").message
    assert "announces 5" in refusal(tmp_path, "bad.pts", "5\n1 2 3\n").message
    assert "commas inside numbers" in refusal(tmp_path, "bad.txt", "1,5 2,5 3,5\n").message


def test_damaged_arrays_are_refused_in_words(tmp_path):
    """Never with an error of numpy or Python, nor with the memory that a header announces."""
    np.save(tmp_path / "good.npy", POINTS)
    whole = (tmp_path / "good.npy").read_bytes()
    words = re.compile("damaged|too short|empty|one array|no points")
    for end in range(len(whole)):
        assert words.search(refusal(tmp_path, "cut.npy", whole[:end]).message), end
    huge = whole.replace(b"(20, 3)", b"(9" + b"9" * 12 + b", 3)")
    assert "too short" in refusal(tmp_path, "huge.npy", huge).message
    assert "damaged" in refusal(tmp_path, "code.npy", whole.replace(b"(20, 3)", b"print()")).message
    np.save(tmp_path / "nan.npy", np.full((5, 3), np.nan))
    with pytest.raises(shapedb.InvalidInput, match="row 0: vertex 0 .*non_finite_coordinate"):
        shapedb.read_scan(tmp_path / "nan.npy")


def test_npy(tmp_path):
    np.save(tmp_path / "scan.npy", np.column_stack([POINTS, POINTS]).astype(np.float32))
    np.testing.assert_allclose(shapedb.read_scan(tmp_path / "scan.npy"), POINTS, atol=1e-7)
    np.save(tmp_path / "flat.npy", POINTS.ravel())
    np.save(tmp_path / "objects.npy", np.array([{"a": 1}]), allow_pickle=True)
    for name in ("flat.npy", "objects.npy"):
        with pytest.raises(shapedb.InvalidInput, match="malformed_file"):
            shapedb.read_scan(tmp_path / name)
    assert refusal(tmp_path, "junk.npy", b"junk").reason == "malformed_file"


def test_obj(tmp_path):
    vertices = "".join("v %g %g %g\n" % tuple(corner) for corner in CORNERS)
    np.testing.assert_array_equal(read(tmp_path, "points.obj", "# a comment\n" + vertices), CORNERS)
    faces = "".join("f " + " ".join(f"{corner + 1}/1/1" for corner in square) + "\n" for square in SQUARES[:3])
    faces += "".join("f " + " ".join(str(corner - 8) for corner in square) + "\n" for square in SQUARES[3:])
    assert read(tmp_path, "cube.obj", vertices + faces, mesh_samples=500).shape == (500, 3)
    assert "line 1" in refusal(tmp_path, "bad.obj", "v 1 2\n").message
    assert "no vertex" in refusal(tmp_path, "none.obj", "g group\n").message
    assert "names vertex 99" in refusal(tmp_path, "far.obj", vertices + "f 1 2 99\n").message


def test_stl(tmp_path):
    triangles = [CORNERS[[a, b, c]] for a, b, c, d in SQUARES] + [CORNERS[[a, c, d]] for a, b, c, d in SQUARES]
    binary = b"\0" * 80 + struct.pack("<I", 12)
    binary += b"".join(struct.pack("<12fH", 0, 0, 0, *triangle.ravel(), 0) for triangle in triangles)
    text = "solid cube\n" + "".join(
        "facet normal 0 0 0\nouter loop\n" + "".join("vertex %g %g %g\n" % tuple(v) for v in triangle) +
        "endloop\nendfacet\n" for triangle in triangles) + "endsolid cube\n"
    np.testing.assert_allclose(read(tmp_path, "a.stl", binary), read(tmp_path, "b.stl", text))
    assert refusal(tmp_path, "short.stl", binary[:-1]).reason == "malformed_file"
    assert "the file ends after line" in refusal(tmp_path, "short.stl", text[:200]).message


def test_a_dense_mesh_keeps_its_vertices(tmp_path):
    steps = np.linspace(0, 1, 150)
    x, y = (axis.ravel() for axis in np.meshgrid(steps, steps))
    vertices = np.column_stack([x, y, np.sin(x)])
    corner = np.arange(149 * 150).reshape(149, 150)[:, :149].ravel()
    faces = np.column_stack([corner, corner + 1, corner + 150])
    found = read(tmp_path, "dense.ply", ply(vertices, "<", "double", faces.tolist()))
    np.testing.assert_array_equal(found, vertices)
    few = read(tmp_path, "few.ply", ply(vertices[:200], "<", "double", [(0, 1, 2)]))
    assert len(few) == 200


def test_other_formats_are_named(tmp_path):
    for name, remedy in (("scan.las", "shapedb add"), ("scan.las", "laspy.read(FILE).xyz"), ("scan.glb.gz", "shapedb add"),
                         ("scan.3mf", "trimesh.load(FILE"), ("scan.e57", "trimesh or Open3D"), ("scan.e57", "Other formats"),
                         ("scan", "Other formats")):
        error = refusal(tmp_path, name, b"")
        assert error.reason == "unknown_file_format" and remedy in error.message, error.message
        assert ".ply" in error.message
    with pytest.raises(shapedb.ShapeDBError, match="file_not_readable"):
        shapedb.read_scan(tmp_path / "missing.ply")
    with pytest.raises(shapedb.InvalidInput, match="mesh_samples"):
        shapedb.read_scan(tmp_path / "missing.ply", mesh_samples=0)


@pytest.mark.parametrize("ending", [".ply", ".stl", ".obj", ".xyz", ".npy"])
def test_an_empty_file_is_told_so(tmp_path, ending):
    path = tmp_path / ("empty" + ending)
    path.write_bytes(b"")
    with pytest.raises(shapedb.ShapeDBError, match="empty.*the file is empty") as refused:
        shapedb.read_scan(path)
    assert refused.value.reason == "malformed_file"


def test_a_file_without_points_is_told_so(tmp_path):
    path = tmp_path / "comment.xyz"
    path.write_text("# nothing\n")
    with pytest.raises(shapedb.ShapeDBError, match="no point "):
        shapedb.read_scan(path)
