# SPDX-License-Identifier: GPL-3.0-or-later
"""What is peculiar to one format."""

import gzip
import struct

from shapes import (CUBE, FACES, FAR, SQUARES, VERTICES, binaries, numbered, obj_text, off_text, pcd_header, ply_binary, ply_header,
                    ply_text, reads, refused, rows, stl_binary, texts)


def cases():
    yield from ply_faces()
    yield from ply_elements()
    yield from ply_headers()
    yield from pcd_fields()
    yield from pcd_headers()
    yield from off()
    yield from obj()
    yield from columns()
    yield from refused_text()
    yield from far()
    yield from other_formats()
    yield from wrong_endings()


def ply_faces():
    """Faces under every name are faces, or are told."""
    for face in ("face", "faces", "polygon", "triangles"):
        for indices in ("vertex_indices", "vertex_index", "Vertex_Index", "corners", "anything"):
            yield reads(f"ply: {face} with {indices}", "a.ply", ply_text(face=face, indices=indices), "mesh")
    for form, data in (("ascii", ply_text(CUBE, SQUARES, face="cells", indices="corners")),
                       ("little", ply_binary("<", CUBE, SQUARES, face="cells", indices="corners", types="uchar uint")),
                       ("big", ply_binary(">", CUBE, SQUARES, face="cells", indices="corners"))):
        yield reads(f"ply: cells with corners, {form}", "a.ply", data, "cube")
        yield reads(f"ply: cells with vertex_index, {form}", "a.ply", data.replace(*two(data, "corners", "vertex_index")), "cube")
        yield reads(f"ply: faces with corners, {form}", "a.ply", data.replace(*two(data, "cells", "faces")), "cube")
    other = {"face": "groups", "indices": "members"}
    for kind, polygons in (("an index that is not there", [(0, 1, 9)]), ("a negative index", [(0, -1, 2)]), ("pairs", [(0, 1), (1, 2)]),
                           ("a corner twice", [(0, 1, 2, 0)]), ("an empty list", [(0, 1, 2), ()])):
        yield reads(f"ply: a list of another name with {kind}", "a.ply", ply_text(CUBE, polygons, **other), "cube points",
                    ignored="list members of element groups")
    both = ply_header("ascii").replace("end_header", "element groups 1\nproperty list uchar int members\nend_header")
    yield reads("ply: a list of another name beside faces", "a.ply", both + rows() + numbered() + "3 0 1 4\n", "mesh",
                ignored="list members of element groups")
    yield reads("ply: no entry in a list of another name", "a.ply", ply_text(CUBE, [], **other), "cube points")
    for kind, polygons, says in (("an index that is not there", [(0, 1, 2), (0, 1, 9)], ("face 1 of 2 names vertex 9", "has 5 vertices")),
                                 ("a negative index", [(0, -1, 2)], ("face 0 of 1 names vertex -1", "counted from 0"))):
        yield refused(f"ply: {kind}", "a.ply", ply_text(polygons=polygons), "line ", *says)
        yield refused(f"ply: {kind}, binary", "a.ply", ply_binary(polygons=polygons), "byte ", *says)
    yield refused("ply: an index with a point", "a.ply", ply_text().replace("3 0 2 1", "3 0.0 2.0 1.0"), "line 17", "entry 0", "'0.0'")
    yield refused("ply: a length with a point", "a.ply", ply_text().replace("3 0 2 1", "3.0 0 2 1"), "line 17", "length", "'3.0'")
    wrong = numbered().replace("3 0 2 1", "3 0 9\n2")
    yield refused("ply: an index that is not there before a line end", "a.ply", ply_header("ascii") + rows() + wrong, "line 17", "vertex 9")
    yield refused("ply: indices that are not whole", "a.ply", ply_text(types="uchar float"), "header", "integers")
    yield refused("ply: a face without a list", "a.ply", ply_text().replace("list uchar int vertex_indices", "int a"),
                  "header", "needs a list vertex_indices")
    lists = ply_header("ascii", indices="a").replace("end_header", "property list uchar int b\nend_header")
    yield refused("ply: a face with two lists", "a.ply", lists + rows() + numbered(), "several lists under other names")
    yield refused("ply: a negative length", "a.ply",
                  ply_header("binary_little_endian", 1, 1, types="char int").encode() + bytes(12) + b"\xff", "byte ", "negative length")
    texture = ply_header("ascii", indices="vertex_index").replace("end_header", "property list uchar float texcoord\nend_header")
    yield reads("ply: a second list of floats", "a.ply", texture + rows() + numbered().replace("\n", " 2 0.5 0.5\n"), "mesh")
    yield reads("ply: polygons", "a.ply", ply_text(CUBE, SQUARES), "cube")
    yield reads("ply: triangles and squares", "a.ply", mixed("<"), "cube")
    yield reads("ply: triangles and squares, big", "a.ply", mixed(">"), "cube")


def two(data, old, new):
    return (old, new) if isinstance(data, str) else (old.encode(), new.encode())


def mixed(order):
    """Squares, the last of them as two triangles."""
    a, b, c, d = SQUARES[-1]
    return ply_binary(order, CUBE, [*SQUARES[:-1], (a, b, c), (a, c, d)])


def ply_elements():
    header = ("ply\nformat {} 1.0\nelement range_grid 3\nproperty list uchar int vertex_indices\nelement vertex 5\n"
              "property uchar quality\nproperty double z\nproperty list ushort float weights\nproperty float x\nproperty float y\n"
              "element tristrips 1\nproperty list int int vertex_indices\nend_header\n")
    strip = (0, 1, 2, 3, -1, 1, 2, 4)
    text = "0\n1 4\n0\n" + "".join(f"7 {z} 2 0.5 0.25 {x} {y}\n" for x, y, z in VERTICES) + "8 " + " ".join(map(str, strip))
    yield reads("ply: a grid, lists and strips", "a.ply", header.format("ascii") + text + "\n", "strips")
    for order, form in (("<", "binary_little_endian"), (">", "binary_big_endian")):
        data = bytes(1) + struct.pack(order + "Bi", 1, 4) + bytes(1)
        data += b"".join(struct.pack(order + "BdH2fff", 7, z, 2, 0.5, 0.25, x, y) for x, y, z in VERTICES)
        data += struct.pack(order + "i8i", 8, *strip)
        yield reads(f"ply: a grid, lists and strips, {form}", "a.ply", header.format(form).encode() + data, "strips")
        for scalar, letter in (("char", "b"), ("short", "h"), ("int", "i"), ("int64", "q"), ("uint64", "Q"), ("uchar", "B")):
            yield reads(f"ply: coordinates of type {scalar}, {form}", "a.ply",
                        ply_header(form, 1, None, scalar=scalar).encode() + struct.pack(f"{order}3{letter}", 1, 2, 3), "one")
    empty = ply_header("ascii", 1, None).replace("end_header", "element nothing 7\nend_header")
    yield reads("ply: an element without properties", "a.ply", empty + "1 2 3\n", "one")
    before = ply_header("binary_big_endian", 1, None).replace("element vertex", "element camera 2\nproperty short a\nelement vertex")
    yield reads("ply: an element before the vertices", "a.ply", before.encode() + bytes(4) + struct.pack(">3f", 1, 2, 3), "one")
    yield refused("ply: an element cut short", "a.ply", before.encode() + bytes(3), "2 camera records of 2 bytes", "room for 1")


def ply_headers():
    point = "1 2 3\n"
    header = ply_header("ascii", 1, None)
    for names in ("XYZ", "xYz"):
        yield reads(f"ply: {names}", "a.ply", ply_header("ascii", 1, None, names=names) + point, "one")
    yield reads("ply: x before X", "a.ply", ply_header("ascii", 1, None, names="Xyzx") + "7 2 3 1\n", "one")
    yield reads("ply: Created by without a comment", "a.ply", header.replace("comment", "Created") + point, "one")
    yield reads("ply: a CR after ply", "a.ply", "ply\r" + header[4:] + point, "one")
    bad = (
        ("another word", header.replace("ply\n", "plyx\n", 1), "line 1: expected 'ply'"),
        ("no line end", "ply", "line 1: expected 'ply'"), ("nothing else", "ply\n", "line 1", "before 'end_header'"),
        ("no end of the header", header.replace("end_header\n", ""), "before 'end_header'"),
        ("no format", header.replace("format ascii 1.0\n", ""), "line 8", "no 'format' line"),
        ("an unknown format", header.replace("ascii", "asci"), "line 2", "'asci'"),
        ("an unknown keyword", header.replace("comment", "remark"), "line 3", "'remark'"),
        ("an unknown type", header.replace("float y", "real y"), "line 7", "expected a type", "'real'"),
        ("a list whose length is no integer", header.replace("float y", "list float int y"), "line 7", "integer type", "'float'"),
        ("a property without a name", header.replace("float y", "float"), "line 7", "property name"),
        ("a property before elements", header.replace("element vertex 1\n", ""), "line 5", "before any 'element'"),
        ("no count", header.replace("vertex 1", "vertex one"), "line 5", "'one'"), ("a negative count", header.replace("vertex 1", "vertex -1"), "line 5", "'-1'"),
        ("no z", header.replace("property float z\n", ""), "header", "no property 'z'"),
        ("two x", header.replace("float y", "float x\nproperty float y"), "header", "one number 'x'"),
        ("a list of x", header.replace("float x", "list uchar int x"), "header", "one number 'x'"),
        ("no vertices", header.replace("vertex", "point"), "no element vertex"),
        ("vertices twice", header.replace("end_header", "element vertex 2\nend_header"), "appears twice"),
    )
    for name, text, *says in bad:
        yield refused(f"ply: {name}", "a.ply", text, *says)


def pcd_fields():
    def binary(points=VERTICES, before=b"", between=b"", after=b"", letter="f", **fields):
        data = pcd_header("binary", len(points), **fields).encode()
        for x, y, z in points:
            pack = lambda number: struct.pack("<" + letter, number)
            data += before + pack(x) + between + pack(y) + pack(z) + after
        return data

    yield reads("pcd: padding of COUNT 0", "a.pcd", binary(fields="x y z _", sizes="4 4 4 1", types="F F F U", counts="1 1 1 0"), "points")
    yield reads("pcd: padding", "a.pcd", binary(between=bytes(4), after=bytes(3), fields="x _ y z _", sizes="4 1 4 4 1",
                                                types="F U F F U", counts="1 4 1 1 3"), "points")
    yield reads("pcd: a field of COUNT 0", "a.pcd", binary(fields="a x y z", sizes="4 4 4 4", types="F F F F", counts="0 1 1 1"), "points")
    yield reads("pcd: a field of COUNT 3", "a.pcd", binary(before=bytes(range(1, 13)), fields="normal x y z", sizes="4 4 4 4",
                                                           types="F F F F", counts="3 1 1 1"), "points")
    yield reads("pcd: double", "a.pcd", binary(letter="d", fields="x y z", sizes="8 8 8", types="F F F", counts="1 1 1"), "points")
    for letter, size, kind in (("b", 1, "I"), ("H", 2, "U"), ("i", 4, "I"), ("Q", 8, "U"), ("q", 8, "I")):
        yield reads(f"pcd: coordinates of type {kind}{size}", "a.pcd",
                    binary([(1, 2, 3)], letter=letter, fields="x y z", sizes=f"{size} " * 3, types=f"{kind} " * 3, counts="1 1 1"), "one")
    yield reads("pcd: another order", "a.pcd", pcd_header("ascii", 1, "z x i y") + "3 1 7 2\n", "one")
    yield reads("pcd: COUNT 3 as text", "a.pcd", pcd_header("ascii", 1, "n x y z", counts="3 1 1 1") + "7 8 9 1 2 3\n", "one")
    yield reads("pcd: COUNT 0 as text", "a.pcd", pcd_header("ascii", 1, "n x y z", counts="0 1 1 1") + "1 2 3\n", "one")
    yield reads("pcd: X Y Z", "a.pcd", pcd_header("ascii", 1, "X Y Z i") + "1 2 3 4\n", "one")
    yield reads("pcd: x before X", "a.pcd", pcd_header("ascii", 1, "X y z x") + "7 2 3 1\n", "one")


def pcd_headers():
    short = "FIELDS x y z\nPOINTS 1\nDATA ascii\n1 2 3\n"
    yield reads("pcd: the shortest header", "a.pcd", short, "one")
    yield reads("pcd: COLUMNS", "a.pcd", short.replace("FIELDS", "COLUMNS"), "one")
    yield reads("pcd: WIDTH alone", "a.pcd", short.replace("POINTS", "WIDTH"), "one")
    yield reads("pcd: HEIGHT 0", "a.pcd", short.replace("POINTS 1", "POINTS 1\nWIDTH 0\nHEIGHT 0"), "one")
    yield reads("pcd: rows", "a.pcd", "FIELDS x y z\nWIDTH 1\nHEIGHT 2\nDATA ascii\n1 2 3\n4 5 6\n", "two")
    bad = (
        ("no DATA", "FIELDS x y z\n", "line 1", "before the DATA line"), ("no FIELDS", "POINTS 1\nDATA ascii\n1 2 3\n", "no FIELDS line"),
        ("no number of points", "FIELDS x y z\nDATA ascii\n", "line 2", "neither POINTS nor WIDTH"),
        ("POINTS that disagree", short.replace("POINTS 1", "POINTS 1\nWIDTH 2"), "POINTS is 1", "is 2"),
        ("no field y", short.replace("x y", "x i"), "line 1", "no field 'y'"), ("two of x", short.replace("x y", "x x"), "'x' appears twice"),
        ("FIELDS twice", "FIELDS x y z\n" + short, "line 2", "second FIELDS"),
        ("an unknown keyword", "HELLO\n" + short, "line 1", "'HELLO'"),
        ("SIZE of fewer fields", short.replace("POINTS", "SIZE 4 4\nPOINTS"), "line 2", "expected SIZE 1 to 8 for field 'z'"),
        ("SIZE of more fields", short.replace("POINTS", "SIZE 4 4 4 4\nPOINTS"), "line 2", "one entry for each of its 3 fields"),
        ("SIZE before FIELDS", "SIZE 4\n" + short, "line 1", "must follow FIELDS"),
        ("an unknown type", short.replace("POINTS", "TYPE F F D\nPOINTS"), "line 2", "'D'"),
        ("a coordinate of three numbers", short.replace("POINTS", "COUNT 1 3 1\nPOINTS"), "field 'y' is 3 x F4"),
        ("a coordinate of no type", short.replace("POINTS", "SIZE 4 2 4\nPOINTS"), "field 'y' is 1 x F2"),
        ("an unknown encoding", short.replace("ascii", "text"), "line 3", "'text'"),
        ("no number", short.replace("POINTS 1", "POINTS one"), "line 2", "expected a number after POINTS", "'one'"),
        ("a column too many", short.replace("1 2 3", "1 2 3 4"), "line 4", "expected the line end", "'4'"),
        ("a column too few", short.replace("1 2 3", "1 2"), "line 4", "field 'z'", "nothing"),
        ("only comments", "# a\n# b\n", "line 2", "before the DATA line"),
    )
    for name, text, *says in bad:
        yield refused(f"pcd: {name}", "a.pcd", text, *says)


def off():
    body = rows() + numbered()
    for name, text in (
        ("counts on the first line", "OFF 5 4 0\n" + body), ("counts without a blank", "OFF5 4 0\n" + body), ("no OFF", "5 4 0\n" + body),
        ("no edges", "OFF\n5 4\n" + body), ("edges on a line of their own", "OFF\n5 4\n0\n" + body), ("counts over lines", "OFF\n5\n4\n0\n" + body),
        ("colours of faces", "OFF\n5 4 0\n" + rows() + numbered().replace("\n", " 0.5 0 1\n")),
        ("COFF", "COFF\n5 4 0\n" + rows(after=" 1 0 0 1") + numbered()), ("NOFF", "NOFF\n5 4 0\n" + rows(after=" 0 0 1") + numbered()),
        ("STCNOFF", "STCNOFF\n5 4 0\n" + rows(after=" 0 0 1 1 0 0 1 0.5 0.5") + numbered()),
        ("CNOFF on one line", "CNOFF\n5 4 0\n" + (rows(after=" 0 0 1 1 0 0 1") + numbered()).replace("\n", " ")),
    ):
        yield reads(f"off: {name}", "a.off", text, "mesh")
    yield reads("off: polygons", "a.off", off_text(CUBE, SQUARES), "cube")
    yield reads("off: points", "a.off", "OFF\n5 0 0\n" + rows(), "points")
    for name, text, *says in (
        ("binary", "OFF BINARY\n" + body, "line 1", "binary OFF is not read"), ("4OFF", "4OFF\n5 4 0\n" + body, "line 1", "'4OFF'"),
        ("nOFF", "nOFF\n3\n5 4 0\n" + body, "line 1", "'nOFF'"), ("another word", "OBJ\n5 4 0\n" + body, "line 1", "'OBJ'"),
        ("no counts", "OFF\n", "after line 1", "the numbers of vertices and faces"), ("one count", "OFF\n5\n", "line 2", "nothing"),
        ("counts that are no numbers", "OFF\nfive 4 0\n", "line 2", "'five'"), ("only a comment", "# nothing\n", "line 1", "no content"),
        ("a corner that is not there", "OFF\n5 1 0\n" + rows() + "3 0 1 9\n", "line 8", "face 0 of 1 names vertex 9", "5 vertices"),
        ("a corner with a point", "OFF\n5 1 0\n" + rows() + "3 0 1 2.0\n", "line 8", "corner 2 of face 0 of 1", "'2.0'"),
        ("a length with a point", "OFF\n5 1 0\n" + rows() + "3.0 0 1 2\n", "line 8", "number of corners", "'3.0'"),
        ("a negative corner", "OFF\n5 1 0\n" + rows() + "3 0 1 -1\n", "line 8", "corner 2 of face 0 of 1", "'-1'"),
        ("a vertex missing", "OFF\n5 0 0\n" + rows(VERTICES[:4]), "the file ends after line 6", "vertex 4 of 5"),
    ):
        yield refused(f"off: {name}", "a.off", text, *says)


def obj():
    vertices = "".join(f"v {line}\n" for line in rows().splitlines())
    faces = lambda number: "".join("f " + " ".join(str(number(i)) for i in one) + "\n" for one in FACES)
    yield reads("obj: negative numbers", "a.obj", vertices + faces(lambda i: i - 5), "mesh")
    yield reads("obj: faces before vertices", "a.obj", faces(lambda i: i + 1) + vertices, "mesh")
    yield reads("obj: normals and texture", "a.obj", vertices + faces(lambda i: f"{i + 1}/7/-1"), "mesh")
    yield reads("obj: fo", "a.obj", vertices + faces(lambda i: i + 1).replace("f ", "fo "), "mesh")
    yield reads("obj: weights and colours", "a.obj", vertices.replace("\n", " 1 0 0\n") + faces(lambda i: i + 1), "mesh")
    yield reads("obj: polygons", "a.obj", obj_text(CUBE, SQUARES), "cube")
    yield reads("obj: points", "a.obj", vertices + "p 1 2 3\nl 1 2\n", "points")
    yield reads("obj: a face of two corners", "a.obj", vertices + "f 1 2\n", "points")
    yield reads("obj: a face of a corner twice", "a.obj", vertices + "f 1 2 2\n", "points")
    for name, text, *says in (
        ("no vertex", "g group\n", "no vertex"), ("two numbers", "v 1 2\n", "line 1", "vertex 0", "nothing"),
        ("a face without numbers", vertices + "f a b c\n", "line 6", "'a'"), ("a corner 0", vertices + "f 0 1 2\n", "line 6", "'0'"),
        ("a corner that is not whole", vertices + "f 1.5 1 2\n", "line 6", "'1.5'"),
        ("a corner that is not there", vertices + "f 1 2 9\n", "line 6", "vertex 9", "5 vertices", "counted from 1"),
        ("a negative corner that is not there", "v 1 2 3\nf -2 1 1\n" + vertices, "line 2", "vertex -2", "1 vertex,"),
        ("an absurd corner", vertices + "f 1 2 4294967296\n", "line 6", "4294967296"),
        ("more than 64 bits", vertices + "f 1 2 99999999999999999999\n", "line 6", "'99999999999999999999'"),
    ):
        yield refused(f"obj: {name}", "a.obj", text, *says)


def columns():
    good = (
        ("Z before Y", "id,Z,Y,X\n7,3,2,1\n8,6,5,4\n"), ("x last", "a;b;x;y;z\n7;7;1;2;3\n7;7;4;5;6\n"), ("named, with tabs", "Y\tX\tZ\n2\t1\t3\n5\t4\t6\n"),
        ("units", "X [m], Y [m], Z [m]\n1, 2, 3\n4, 5, 6\n"), ("units in round brackets", "z(mm) y(mm) x(mm)\n3 2 1\n6 5 4\n"),
        ("quotes", '"X","Y","Z"\n"1","2","3"\n"4","5","6"\n'), ("named in a comment", "//Z,Y,X\n3,2,1\n6,5,4\n"),
        ("named in a comment with #", "# i x y z\n7 1 2 3\n7 4 5 6\n"), ("a sentence that names x y z", "# in this file x y z are the columns\n1 2 3\n4 5 6\n"),
        ("a count after the names", "2\nx y z\n1 2 3\n4 5 6\n"), ("two scans", "1\n1 2 3\n1\n4 5 6\n"), ("more columns", "1 2 3 7 8\n4 5 6 a b\n"),
        ("semicolons and blanks", "1 ; 2 ; 3\n4 ;5; 6\n"), ("a comma at the end", "1,2,3,\n4,5,6,\n"), ("blanks at the start", "  1 2 3\n\t4 5 6\n"),
        ("comment signs", "# c\n// c 1 2 3\n; c\n% c\n! c\n1 2 3\n#7 8 9\n4 5 6\n%"),
    )
    for name, text in good:
        for ending in ("xyz", "csv", "txt", "asc", "pts", "xyzn", "xyzrgb"):
            if ending == "xyz" or name in ("Z before Y", "named in a comment"):
                yield reads(f"{ending}: {name}", f"a.{ending}", text, "two")


def refused_text():
    bad = (
        ("two columns", "1 2\n", "line 1", "expected three numbers x y z", "nothing"), ("letters", "1 2 3\n4 5 six\n", "line 2", "'six'"),
        ("letters first", "one two three\n1 2 3\n", "line 1", "'one'"), ("decimal commas", "1,5 2,5 3,5\n", "line 1", "commas inside numbers"),
        ("decimal commas and semicolons", "1,5;2,5;3,5\n", "line 1", "commas inside numbers"),
        ("a named column that is missing", "a,b,z,y,x\n1,2,3\n", "line 2", "nothing"),
        ("only comments", "# nothing\n", "no point"), ("too many", "1\n1 2 3\n4 5 6\n", "announces 1 point, but has 2"),
        ("too few", "3\n1 2 3\n4 5 6\n", "announces 3 points, but has 2"), ("a count of two numbers", "1 2 3\n4 5\n", "line 2"),
        ("an empty column", "1,,3\n", "line 1", "nothing"),
    )
    for name, text, *says in bad:
        yield refused(f"xyz: {name}", "a.xyz", text, *says)


def far():
    """Seven digits do not hold coordinates of millions."""
    text = "".join(f"{x!r} {y!r} {z!r}\n" for x, y, z in FAR)
    yield reads("xyz: far from the origin", "a.xyz", text, "far")
    yield reads("obj: far from the origin", "a.obj", "".join(f"v {line}\n" for line in text.splitlines()), "far")
    yield reads("off: far from the origin", "a.off", "OFF\n5 0 0\n" + text, "far")
    for form, order in (("little", "<"), ("big", ">")):
        yield reads(f"ply: far from the origin, {form}", "a.ply",
                    ply_header(f"binary_{form}_endian", 5, None, scalar="double").encode() + b"".join(struct.pack(order + "3d", *one) for one in FAR), "far")
    yield reads("ply: far from the origin, ascii", "a.ply", ply_header("ascii", 5, None, scalar="double") + text, "far")
    yield reads("pcd: far from the origin", "a.pcd",
                pcd_header("binary", 5, "x y z", "8 8 8", "F F F", "1 1 1").encode() + b"".join(struct.pack("<3d", *one) for one in FAR), "far")
    rounded = b"".join(struct.pack("<3f", *one) for one in FAR)
    yield refused("ply: far from the origin in single precision", "a.ply", ply_header("binary_little_endian", 5, None).encode() + rounded,
                  "single precision", "the shape was lost", reason="coordinate_out_of_range")
    yield refused("pcd: far from the origin in single precision", "a.pcd",
                  pcd_header("binary", 5, "x y z", "4 4 4", "F F F", "1 1 1").encode() + rounded, "the shape was lost",
                  reason="coordinate_out_of_range")


def other_formats():
    for name in ("scan.e57", "scan.laz", "model.fbx", "scan", "notes.md", "scan.gz"):
        yield refused(f"no format: {name}", name, "1 2 3\n", reason="unknown_file_format")


NAMES = {
    "ply": "a PLY file", "pcd": "a PCD file", "off": "an OFF file", "obj": "an OBJ file", "stl": "an STL file", "xyz": "text with a point on each line",
    "las": "a LAS file", "gltf": "a glTF file", "glb": "a glTF file", "3mf": "a 3MF file",
}


def wrong_endings():
    """Each format under the endings of all others is named, and no reader makes a count of its letters."""
    files = {**{name: data.encode() for name, (data, _) in texts().items()}, **{name: data for name, (data, _) in binaries().items()},
             "bigtitle.stl": stl_binary(b"\x80 exported by a test"), "binary.stl": stl_binary(), "points.las": b"LASF" + bytes(223) + b"\1" * 60,
             "scene.gltf": b'{"asset": {"version": "2.0"}, "scenes": []}', "scene.glb": b"glTF\2\0\0\0\24\0\0\0" + bytes(8),
             "part.3mf": b"PK\3\4" + bytes(26) + b"3D/3dmodel.model" + bytes(60)}
    for name, data in files.items():
        kind = {"csv": "xyz", "pts": "xyz"}.get(name.split(".")[-1], name.split(".")[-1])
        for ending in ("ply", "pcd", "off", "obj", "stl", "xyz", "csv"):
            other = "xyz" if ending == "csv" else ending
            if other != kind:
                yield refused(f"{ending}: the bytes of {name}", f"a.{ending}", data,
                              f"this is {NAMES[kind]}, not {NAMES[other]}: rename it to end in .{kind}")
    for name, text in texts().items():
        kind = "stl" if name != "stl" else "ply"
        yield refused(f"{kind}: packed {name}", f"a.{kind}.gz", gzip.compress(text[0].encode(), mtime=0), f"not {NAMES[kind]}: rename it")
        utf16 = ("\ufeff" + text[0]).encode("utf-16-le")
        yield refused(f"{kind}: {name} in UTF-16", f"a.{kind}", utf16, f"not {NAMES[kind]}: rename it")
    yield refused("stl: a PLY header in capitals", "a.stl", ply_binary().replace(b"ply\n", b"PLY\r", 1), "this is a PLY file")
    yield refused("ply: the shortest PCD", "a.ply", "FIELDS x y z\nPOINTS 1\nDATA ascii\n1 2 3\n", "this is a PCD file")
    for first in ("COFF", "STCNOFF", "off", "OFF BINARY", "OFF5 4 0"):
        yield refused(f"ply: {first}", "a.ply", f"# a comment\n{first}\n", "this is an OFF file")
    # What begins like no format keeps the words of the reader, and a damaged file those of its own.
    for name, text, *says in (
        ("ply: a sentence", "Off we go\n", "expected 'ply'"), ("pcd: a sentence", "version two of this text\n", "DATA line"),
        ("off: whole numbers", "1 2 3\n4 5 6\n", "line 2"), ("off: an archive", "PK\3\4 of another kind", "unpack it first"),
        ("ply: an STL file without facets", "solid\n", "expected 'ply'"), ("ply: damaged", "ply\nformat solid\n", "line 2"),
    ):
        yield refused(f"{name}, as it is", f"a.{name.split(':')[0]}", text, *says)
    for form in ("binary_little_endian", "binary_big_endian"):
        yield refused(f"ply: {form} that is text", "a.ply", ply_text().replace("ascii", form), "announces binary data, but text follows")
    for form in ("binary", "binary_compressed"):
        yield refused(f"pcd: {form} that is text", "a.pcd", pcd_header(form, 50) + rows(after=" 255"), "announces binary data, but text follows")
    document = b"%PDF-1.4 " + bytes(range(128, 192)) + b" of some words" + bytes(40)
    yield refused("stl: letters for a number", "a.stl", document, "this is not an STL file: it does not begin with 'solid'")
