# SPDX-License-Identifier: GPL-3.0-or-later
"""Binary data: what stands before it and after it, and headers that say too much or too little."""

import gzip
import struct

from shapes import (VERTICES, binaries, by_field, compressed_body, lzf_literals, pcd_binary, pcd_compressed, pcd_header,
                    pcd_text, ply_binary, ply_header, reads, refused, rows, stl_binary, stl_text, texts)


def cases():
    for name, (data, shape) in binaries().items():
        yield from headers(name, data, shape)
    files = {**binaries(), "binary.stl": (stl_binary(), "surface")}
    for name, (data, shape) in files.items():
        yield reads(f"{name}: plain", name, data, shape)
        yield reads(f"{name}: packed", name + ".gz", gzip.compress(data, mtime=0), shape)
        yield reads(f"{name}: zero bytes at the end", name, data + bytes(4096), shape)
        yield reads(f"{name}: a line end at the end", name, data + b"\r\n", shape)
        more = bytes((0, 0, 1, 0)) + b"\2" * 60
        yield refused(f"{name}: more than announced", name, data + more, "byte ")
        yield refused(f"{name}: more after zero bytes", name, data + bytes(4096) + b"x", "byte ")
        for cut in (1, 13, 40):
            yield refused(f"{name}: cut short by {cut}", name, data[:-cut], "byte ")
    yield from line_feed_first()
    yield from counts()
    yield from compressed()
    yield from stl()


def headers(name, data, shape):
    mark = next(mark for mark in (b"end_header\n", b"DATA binary_compressed\n", b"DATA binary\n") if mark in data)
    size = data.index(mark) + len(mark)
    header, body = data[:size], data[size:]
    for kind, changed in (("CR", header.replace(b"\n", b"\r")), ("CR LF", header.replace(b"\n", b"\r\n")),
                          ("blanks before line ends", header.replace(b"\n", b" \n")), ("capitals", header.upper()),
                          ("lower case", header.lower()), ("a mark", b"\xef\xbb\xbf" + header)):
        yield reads(f"{name}: header with {kind}", name, changed + body, shape)
    yield refused(f"{name}: header in UTF-16", name, ("\ufeff" + header.decode()).encode("utf-16-le") + body * 2,
                  "binary data", "UTF-16")


def line_feed_first():
    """After lines that end in CR alone a line feed is the first byte of the data."""
    for name, end in (("CR", "\r"), ("LF", "\n"), ("CR LF", "\r\n")):
        ply = ply_header("binary_little_endian", 1, None, names="ayxz").replace("float a", "char a").replace("\n", end)
        yield reads(f"ply: data that begins with a line feed after {name}", "a.ply",
                    ply.encode() + b"\n" + struct.pack("<3f", 2, 1, 3), "one")
        pcd = pcd_header("binary", 1, "a x y z", "1 4 4 4", "U F F F", "1 1 1 1").replace("\n", end)
        yield reads(f"pcd: data that begins with a line feed after {name}", "a.pcd",
                    pcd.encode() + b"\n" + struct.pack("<3f", 1, 2, 3), "one")


def counts():
    """Headers are not trusted, in text either."""
    for ending, (text, _) in texts().items():
        if ending in ("ply", "pcd", "off", "pts"):
            yield refused(f"{ending}: more than announced", f"a.{ending}", text + "3 0 1 2\n",
                          "announces 5 points, but has 6" if ending == "pts" else "line ")
            yield refused(f"{ending}: less than announced", f"a.{ending}", text[:text[:-1].rindex("\n") + 1],
                          "announces 5 points, but has 4" if ending == "pts" else "the file ends after line ")
    huge = 10**9
    body = b"\1" * 120
    yield refused("ply: absurdly many binary vertices", "a.ply", ply_header("binary_little_endian", huge, None).encode() + body,
                  "announces 1000000000 vertex records of 12 bytes", "room for 10")
    yield refused("ply: absurdly many vertices as text", "a.ply", ply_header("ascii", huge, None) + rows(), "vertex 5 of 1000000000")
    yield refused("ply: an absurdly long list", "a.ply",
                  ply_header("binary_little_endian", 1, 1, types="uint int").encode() + bytes(12) + b"\xff" * 4 + bytes(40),
                  "byte ", "face 0 of 1", "entry 10")
    yield refused("pcd: absurdly many binary points", "a.pcd", pcd_header("binary", huge).encode() + body, "byte ", "room for 7")
    yield refused("pcd: absurdly many points as text", "a.pcd", pcd_header("ascii", huge) + rows(after=" 1"), "found 5")
    yield refused("pcd: an absurdly large field", "a.pcd",
                  pcd_header("binary", 10, "x y z junk", "4 4 4 8", "F F F F", "1 1 1 4294967295").encode() + body, "room for 0")
    yield refused("off: absurdly many vertices", "a.off", f"OFF {huge} 0 0\n{rows()}", "vertex 5 of 1000000000")
    yield refused("off: absurdly many corners", "a.off", f"OFF 5 1 0\n{rows()}{huge} 1 2 3\n", "corner 3 of face 0 of 1")
    yield refused("pts: absurdly many points", "a.pts", f"{huge}\n{rows()}", "announces 1000000000 points, but has 5")
    yield refused("stl: absurdly many triangles", "a.stl", b"\0" * 80 + b"\xff" * 4 + body, "byte 80", "4294967295", "room for 2")
    yield reads("pcd: no points", "a.pcd", pcd_header("binary", 0), "none")
    yield reads("ply: no points", "a.ply", ply_header("ascii", 0, 0), "none")
    yield reads("ply: no binary points", "a.ply", ply_header("binary_big_endian", 0, 0), "none")
    yield reads("stl: no binary triangles", "a.stl", b"\1" * 80 + bytes(4), "none")
    wide = pcd_header("{}", 0, "x y z junk", "4 4 4 8", "F F F F", "1 1 1 4294967295")
    yield reads("pcd: no points of an absurdly large field", "a.pcd", wide.format("binary"), "none")
    yield reads("pcd: no points of an absurdly large field as text", "a.pcd", wide.format("ascii"), "none")
    yield reads("pcd: no points, compressed", "a.pcd", pcd_header("binary_compressed", 0).encode() + bytes(8), "none")
    yield refused("ply: absurdly many properties", "a.ply",
                  ply_header("binary_little_endian", 10**9, None).replace("end_header", "property double a\n" * 2000 + "end_header"),
                  "16012 bytes", "room for 0")
    nan = [(float("nan"), 0, 0), *VERTICES[1:]]
    yield refused("ply: a binary NaN", "a.ply", ply_binary("<", nan), "byte ", "vertex 0", reason="non_finite_coordinate")
    yield refused("stl: a binary NaN", "a.stl", stl_binary(vertices=nan), "byte ", "triangle 0", reason="non_finite_coordinate")
    for name, data in (("binary", pcd_binary([*VERTICES, nan[0]])), ("compressed", pcd_compressed([*VERTICES, nan[0]])),
                       ("ascii", pcd_text([*VERTICES, nan[0]]))):
        yield reads(f"pcd: NaN where nothing was measured, {name}", "a.pcd", data, "points", skipped=1)


def compressed():
    header = pcd_header("binary_compressed").encode()
    columns = by_field()
    # A reference of 2 bytes behind, and a long one, to the zeros that end the columns.
    zeros = columns.rindex(struct.pack("<f", 3.5)) + 4
    rest = len(columns) - zeros
    packed = lzf_literals(columns[:zeros + 1]) + bytes((0xe0, rest - 1 - 9, 0))
    yield reads("pcd: compressed with a long reference", "a.pcd", header + compressed_body(columns, packed), "points")
    packed = lzf_literals(columns[:zeros + 2]) + bytes((0x20 * (7 - 2), 1)) + lzf_literals(columns[zeros + 9:])
    yield reads("pcd: compressed with a short reference", "a.pcd", header + compressed_body(columns, packed), "points")
    yield reads("pcd: compressed without getting smaller", "a.pcd", header + compressed_body(columns, columns), "points")
    broken = bytes((0xe0, 200, 9)) + lzf_literals(columns)[3:]
    yield refused("pcd: compressed and damaged", "a.pcd", header + compressed_body(columns, broken), "byte ", "damaged")
    sizes = struct.pack("<II", 400, len(columns))
    yield refused("pcd: compressed and cut short", "a.pcd", header + sizes + lzf_literals(columns), "byte ", "cut short")
    yield refused("pcd: compressed to another size", "a.pcd", header + compressed_body(columns[:-1]), "does not unpack")
    yield refused("pcd: compressed without sizes", "a.pcd", header + b"\1\2\3", "byte ", "size")
    padded = pcd_header("binary_compressed", 5, "x _ y z", "4 1 4 4", "F U F F", "1 4 1 1").encode()
    without = by_field(rest=0)
    yield reads("pcd: compressed without its padding", "a.pcd", padded + compressed_body(without), "points")
    yield reads("pcd: compressed with its padding", "a.pcd", padded + compressed_body(without[:20] + bytes(20) + without[20:]),
                "points")


def stl():
    yield reads("stl: binary that begins with solid", "a.stl", stl_binary(b"solid but binary"), "surface")
    yield reads("stl: binary that is all letters", "a.stl", stl_binary(b"solid " + b"facet normal " * 5), "surface")
    yield reads("stl: text without a name", "a.stl", stl_text(""), "surface")
    yield reads("stl: text whose name has several words", "a.stl", stl_text(" a facet of b"), "surface")
    yield refused("stl: binary announced short", "a.stl", stl_binary(count=3), "data after the last of the announced 3 triangles")
    yield refused("stl: binary announced long", "a.stl", stl_binary(count=5), "byte 80", "5 triangles", "room for 4")
    yield refused("stl: a few bytes", "a.stl", b"\1\2\3", "84 bytes")
    yield refused("stl: text of another kind", "a.stl", "Dear reader,\n" + "this is no solid of any kind.\n" * 20,
                  "expected 'solid'", "'Dear'")
    text = stl_text()
    for what in ("endloop", "endfacet", "outer loop", "facet"):
        yield refused(f"stl: no {what}", "a.stl", text.replace(what, "nothing", 1), "line ", "'nothing'")
    for kept in (0.3, 0.5, 0.7, 0.95):
        yield refused(f"stl: text cut short at {kept}", "a.stl", text[:text.index("\n", int(kept * len(text))) + 1],
                      "the file ends after line ", "expected")
    yield reads("stl: ends of two words", "a.stl",
                text.replace("endloop", "end loop").replace("endfacet", "end facet").replace("endsolid", "end solid"), "surface")
    yield reads("stl: a name without a blank", "a.stl", text.replace("endsolid thing", "endsolidthing"), "surface")
    yield reads("stl: two solids", "a.stl", text.replace("  endfacet\n", "  endfacet\nendsolid thing\nsolid other\n", 1), "surface")
    yield reads("stl: an empty solid", "a.stl", "solid nothing\nendsolid nothing\n", "none")
    yield refused("stl: more after the solid", "a.stl", text + "facet\n", "line ", "expected 'solid'", "'facet'")


