# SPDX-License-Identifier: GPL-3.0-or-later
"""Ways to write text that mean the same in every format: line ends, encodings, case, comments, blanks, numbers."""

import gzip

from shapes import (numbered, pcd_header, ply_header, ply_text, reads, refused, rows,
                    stl_text, texts)


def cases():
    for ending, (text, shape) in texts().items():
        file = f"a.{ending}"
        lines = text.splitlines()
        for kind, changed in (*line_ends(lines), *encodings(text), *blanks(lines), *packed(text)):
            yield reads(f"{ending}: {kind}", file, changed, shape)
        for kind, change in (("capitals", str.upper), ("lower case", str.lower)):
            yield reads(f"{ending}: {kind}", file, change(text), shape)
        yield reads(f"{ending}: ending in capitals", f"A.{ending.upper()}", text, shape)
        yield reads(f"{ending}: .gz after the ending", f"{file}.GZ", gzip.compress(text.encode(), mtime=0), shape)
        yield reads(f"{ending}: comments and blank lines everywhere", file, commented(ending, lines), shape)
        yield from damaged(ending, file, text)
    yield from over_lines()
    yield from numbers()
    yield from backslashes()


def line_ends(lines):
    join = lambda *ends: "".join(line + ends[i % len(ends)] for i, line in enumerate(lines))
    yield "plain", join("\n")
    yield "CR", join("\r")
    yield "CR LF", join("\r\n")
    yield "mixed line ends", join("\r", "\n", "\r\n")
    yield "a lone CR inside", "\n".join(lines[:4]) + "\n" + lines[4] + "\r" + "\n".join(lines[5:]) + "\n"
    yield "no last line end", "\n".join(lines)
    yield "no last CR", "\r".join(lines)
    yield "zero bytes at the end", join("\n") + "\0" * 500
    yield "Ctrl-Z at the end", join("\n") + "\x1a"


def encodings(text):
    yield "UTF-8 with a mark", b"\xef\xbb\xbf" + text.encode()
    for order in ("le", "be"):
        yield f"UTF-16 {order} with a mark", ("\ufeff" + text).encode(f"utf-16-{order}")
        yield f"UTF-16 {order} without a mark", text.encode(f"utf-16-{order}")


def blanks(lines):
    yield "blanks before line ends", "".join(f"{line} \t \n" for line in lines)
    yield "tabs", "\n".join(lines).replace(" ", "\t") + "\n"
    yield "many blanks", "\n".join(lines).replace(" ", " \t ") + "\n"


def packed(text):
    half = len(text) // 2
    whole = gzip.compress(text.encode(), mtime=0)
    yield "packed under a plain name", whole
    yield "packed in two members", gzip.compress(text[:half].encode(), mtime=0) + gzip.compress(text[half:].encode(), mtime=0)
    yield "packed without packing", gzip.compress(text.encode(), 0, mtime=0)
    yield "packed, then zero bytes", whole + bytes(100)


def commented(ending, lines):
    comment = "comment 1 2 3\nobj_info a\n" if ending == "ply" else "# 1 2 3\n"
    # Nothing may stand before the first line of PLY.
    between = f"{comment}\n \t\n"
    return ("" if ending == "ply" else between) + "".join(f"{line}\n{between}" for line in lines) + comment


def damaged(ending, file, text):
    whole = gzip.compress(text.encode(), mtime=0)
    yield refused(f"{ending}: empty", file, "", "the file is empty")
    yield refused(f"{ending}: a mark alone", file, b"\xef\xbb\xbf", "the file is empty")
    yield refused(f"{ending}: a mark of UTF-16 alone", file, b"\xff\xfe", "the file is empty")
    yield refused(f"{ending}: packed nothing", file, gzip.compress(b"", mtime=0), "the file is empty")
    yield refused(f"{ending}: packed and cut short", file, whole[:-9], "the gzip data is cut short")
    yield refused(f"{ending}: packed with a wrong checksum", file, whole[:-8] + bytes(8), "the gzip data is damaged")
    yield refused(f"{ending}: packed, then more", file, whole + b"x", "data after the gzip data")
    yield refused(f"{ending}: UTF-32", file, ("\ufeff" + text).encode("utf-32-le"), "UTF-32", "UTF-8")
    yield refused(f"{ending}: half a character", file, ("\ufeff" + text).encode("utf-16-le") + b"\n", "inside a character")
    yield refused(f"{ending}: a pointer", file, "version https://git-lfs.github.com/spec/v1\noid sha256:1\n", "Git LFS pointer")
    yield refused(f"{ending}: a ZIP archive", file, b"PK\x03\x04" + bytes(40), "ZIP archive", "unpack it first")
    yield refused(f"{ending}: bzip2", file, b"BZh91AY" + bytes(40), "bzip2")


def over_lines():
    """Line ends are no more than blanks to OFF, PLY and STL."""
    off = f"OFF\n5 4 0\n{rows()}{numbered()}"
    for ending, text, shape in (("off", off, "mesh"), ("ply", ply_text(), "mesh"), ("stl", stl_text(), "surface")):
        begin = text.index("end_header\n") + 11 if ending == "ply" else text.index("\n") + 1
        end = text.rindex("endsolid") if ending == "stl" else len(text)
        for kind, blank, line_end in (("one word on each line", "\n", "\n"), ("all on one line", " ", " "),
                                      ("blank lines between words", "\r\n\r\n", "\n")):
            body = text[begin:end].replace("\n", "\0").replace(" ", blank).replace("\0", line_end)
            yield reads(f"{ending}: {kind}", f"a.{ending}", text[:begin] + body + text[end:], shape)
    yield reads("off: a face over several lines", "a.off", off.replace("3 0 2 1", "3 0\n2\n1"), "mesh")
    header = ply_header("ascii", 3, None)
    yield refused("ply: a number is missing", "a.ply", header + "1 2 3\n1 2\n1 2 3\n", "line 12", "vertex 1 of 3",
                  "begins in line 11", "'2'")
    yield refused("ply: a number is missing everywhere", "a.ply", header + "1 2\n1 2\n1 2\n", "vertex 0 of 3")
    yield refused("ply: a number too many", "a.ply", header + "1 2 3\n1 2 3 4\n1 2 3\n", "line 11", "vertex 1 of 3", "line end")
    yield refused("off: a number is missing", "a.off", "OFF\n3 1 0\n1 2 3\n1 2\n1 2 3\n3 0 1 2\n", "line 6")
    yield refused("off: a corner is missing", "a.off", "OFF\n3 2 0\n1 2 3\n1 2 3\n1 2 3\n3 0 1\n3 0 1 2\n", "line 7")


def with_number(word):
    """A file of each format with one point, whose last number is the word."""
    return {
        "ply": ply_header("ascii", 1, None, scalar="double") + f"1 2 {word}\n",
        "pcd": pcd_header("ascii", 1, "x y z", "8 8 8", "F F F", "1 1 1") + f"1 2 {word}\n",
        "off": f"OFF\n1 0 0\n1 2 {word}\n", "obj": f"v 1 2 {word}\n", "xyz": f"1 2 {word}\n", "csv": f"1;2;{word}\n",
    }


def numbers():
    for word in ("1.5", "+1.5", "15e-1", "1.5E+00", "0.15D+1", "0.15d1", "+.15e1", "1.5000000000000000000000000"):
        for ending, text in with_number(word).items():
            yield reads(f"{ending}: the number {word}", f"a.{ending}", text, "one fifth")
    for word in ("two", "0x10", "1_0", "1.5f", "1e", "1d", "--1", "+-1", "1.5.5", "1e5d3", ".", "e5", "1-2"):
        for ending, text in with_number(word).items():
            yield refused(f"{ending}: no number {word}", f"a.{ending}", text, "line ", f"'{word}'")
    for ending, text in with_number("1,5").items():
        if ending not in ("xyz", "csv"):
            yield refused(f"{ending}: a decimal comma", f"a.{ending}", text, "'1,5'", "with a point")
    for word in ("nan", "NaN", "-nan", "inf", "-Infinity", "1.#QNAN", "-1.#IND00", "1.#INF", "1e999"):
        for ending, text in with_number(word).items():
            name = f"{ending}: not finite, {word}"
            if ending == "pcd":
                yield reads(name, "a.pcd", text, "none", skipped=1)
            else:
                yield refused(name, f"a.{ending}", text, "line ", "vertex 0", "NaN or infinite", reason="non_finite_coordinate")
    stl = stl_text()
    yield refused("stl: not finite", "a.stl", stl.replace("vertex 0.500000", "vertex nan", 1), "line ", "vertex 3",
                  reason="non_finite_coordinate")
    yield refused("stl: no number", "a.stl", stl.replace("vertex 0.500000", "vertex two", 1), "line ", "'two'")
    yield refused("stl: a number is missing", "a.stl", stl.replace("0.250000 -4.000000", "0.250000", 1), "line ", "found nothing")


def backslashes():
    """They continue lines of vertices and faces of OBJ, and are letters everywhere else."""
    vertices = "v 0 0 0\nv 1 0 0\nv 0 2 0\n"
    for line in ("# in C:\\parts\\", "#\\", "mtllib C:\\tex\\", "usemtl a\\", "g a \\", "o \\", "vt 0 0 # c\\", "call a.obj \\",
                 "unknown \\"):
        for end, name in (("\n", "LF"), ("\r\n", "CR LF"), ("\r", "CR"), (" \n", "blank")):
            yield reads(f"obj: {line!r} before {name}", "a.obj", f"{line}{end}{vertices}f 1 2 3\n{line}{end}", "triangle")
    yield reads("obj: continued vertices and faces", "a.obj",
                "v 0 \\\r\n 0 \\ \r\n 0\nv 1 0 0 # a\\\nv 0 2 0\nf 1 \\\n2 3 # c \\\n", "triangle")
    yield reads("obj: a backslash at the end of the file", "a.obj", vertices + "f 1 2 3 \\", "triangle")
    yield reads("xyz: a comment ends in a backslash", "a.xyz", "# C:\\\n1 2 3\n// \\\n4 5 6\n", "two")
    yield reads("off: a comment ends in a backslash", "a.off", "OFF # \\\n1 0 0\n1 2 3 # \\\n", "one")
    yield reads("pcd: a comment ends in a backslash", "a.pcd", "# \\\nFIELDS x y z\nPOINTS 1\nDATA ascii\n1 2 3 # \\\n", "one")
    yield reads("ply: a comment ends in a backslash", "a.ply",
                ply_header("ascii", 1, None).replace("test", "test \\") + "1 2 3\ncomment \\\n", "one")
    yield reads("stl: a name ends in a backslash", "a.stl", stl_text(" C:\\"), "surface")


