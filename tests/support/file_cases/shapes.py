# SPDX-License-Identifier: GPL-3.0-or-later
"""What the files hold, and how each format writes it."""

import struct
from dataclasses import dataclass, field

# Numbers that single precision has exactly.
VERTICES = [(0, 0, 0), (1, 0, 0), (0, 2, 0), (0.5, 0.25, -4), (3, 3, 3.5)]
FACES = [(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)]
FAR = [(4400000 + x / 8, 5400000 + y / 8, 120 + z / 8) for x, y, z in VERTICES]
CUBE = [(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)]
SQUARES = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]


def fans(polygons):
    return [[one[0], one[i], one[i + 1]] for one in polygons for i in range(1, len(one) - 1)]


def shape(vertices, polygons=()):
    return {"vertices": [list(map(float, one)) for one in vertices], "triangles": fans(polygons)}


SHAPES = {
    "points": shape(VERTICES),
    "mesh": shape(VERTICES, FACES),
    # STL has no vertices beside those of triangles, in the order of these.
    "surface": shape([VERTICES[i] for i in (0, 2, 1, 3)], [(0, 1, 2), (0, 2, 3), (2, 1, 3), (1, 0, 3)]),
    "strips": shape(VERTICES, [(0, 1, 2), (2, 1, 3), (1, 2, 4)]),
    "cube": shape(CUBE, SQUARES),
    "cube points": shape(CUBE),
    "one": shape([(1, 2, 3)]),
    "one fifth": shape([(1, 2, 1.5)]),
    "two": shape([(1, 2, 3), (4, 5, 6)]),
    "triangle": shape(VERTICES[:3], [(0, 1, 2)]),
    "none": shape([]),
    "far": shape(FAR),
}


@dataclass
class Case:
    name: str
    file: str
    data: bytes
    outcome: dict = field(default_factory=dict)


def reads(name, file, data, what, **more):
    """`skipped`: points of which the file says that nothing was measured; `ignored`: a list that is passed over, and told."""
    data = data.encode("latin-1") if isinstance(data, str) else data
    return Case(name, file, data, {"reads": what, **more})


def refused(name, file, data, *says, reason="malformed_file"):
    """`says`: parts of the message."""
    data = data.encode("latin-1") if isinstance(data, str) else data
    return Case(name, file, data, {"refused": reason, "says": list(says)})


def rows(vertices=VERTICES, after=""):
    return "".join(f"{x:.6f} {y:.6f} {z:.6f}{after}\n" for x, y, z in vertices)


def xyz_properties(scalar="float", names="xyz"):
    return "".join(f"property {scalar} {name}\n" for name in names)


def ply_header(form, vertices=5, faces=4, scalar="float", names="xyz", face="face", indices="vertex_indices",
               types="uchar int"):
    text = f"ply\nformat {form} 1.0\ncomment made by a test\nobj_info num_cols 512\nelement vertex {vertices}\n"
    text += xyz_properties(scalar, names)
    if faces is not None:
        text += f"element {face} {faces}\nproperty list {types} {indices}\n"
    return text + "end_header\n"


def numbered(polygons=FACES):
    return "".join(f"{len(one)} {' '.join(map(str, one))}\n" for one in polygons)


def ply_text(vertices=VERTICES, polygons=FACES, **header):
    return ply_header("ascii", len(vertices), len(polygons), **header) + rows(vertices) + numbered(polygons)


def ply_binary(order="<", vertices=VERTICES, polygons=FACES, scalar="float", **header):
    form = "binary_little_endian" if order == "<" else "binary_big_endian"
    letter = "d" if scalar in ("double", "float64") else "f"
    data = ply_header(form, len(vertices), len(polygons), scalar=scalar, **header).encode()
    data += b"".join(struct.pack(f"{order}3{letter}", *one) for one in vertices)
    return data + b"".join(struct.pack(f"{order}B{len(one)}i", len(one), *one) for one in polygons)


def pcd_header(data, points=5, fields="x y z rgb", sizes="4 4 4 4", types="F F F U", counts="1 1 1 1"):
    return (f"# .PCD v0.7\nVERSION 0.7\nFIELDS {fields}\nSIZE {sizes}\nTYPE {types}\nCOUNT {counts}\nWIDTH {points}\nHEIGHT 1\n"
            f"VIEWPOINT 0 0 0 1 0 0 0\nPOINTS {points}\nDATA {data}\n")


def pcd_text(vertices=VERTICES):
    return pcd_header("ascii", len(vertices)) + rows(vertices, " 255")


def pcd_binary(vertices=VERTICES):
    return pcd_header("binary", len(vertices)).encode() + b"".join(struct.pack("<3fI", *one, 255) for one in vertices)


def lzf_literals(data):
    """Packed without one reference to what came before, which every reader must take."""
    return b"".join(bytes([len(part) - 1]) + part for part in (data[i:i + 32] for i in range(0, len(data), 32)))


def compressed_body(unpacked, packed=None):
    packed = lzf_literals(unpacked) if packed is None else packed
    return struct.pack("<II", len(packed), len(unpacked)) + packed


def by_field(vertices=VERTICES, rest=4):
    columns = b"".join(struct.pack(f"<{len(vertices)}f", *(one[axis] for one in vertices)) for axis in range(3))
    return columns + bytes(rest * len(vertices))


def pcd_compressed(vertices=VERTICES):
    return pcd_header("binary_compressed", len(vertices)).encode() + compressed_body(by_field(vertices))


def off_text(vertices=VERTICES, polygons=FACES):
    return f"OFF # a comment\n\n{len(vertices)} {len(polygons)} 0\n{rows(vertices)}{numbered(polygons)}"


def obj_text(vertices=VERTICES, polygons=FACES):
    forms = ("", "/1", "//1", "/1/1")
    faces = "".join("f " + " ".join(f"{i + 1}{forms[n % 4]}" for i in one) + "\n" for n, one in enumerate(polygons))
    return "# made by a test\nmtllib a.mtl\no thing\n" + "".join(f"v {line}\n" for line in rows(vertices).splitlines()) \
        + "vt 0 0\nvn 0 0 1\ns off\n" + faces


def stl_text(name=" thing"):
    text = f"solid{name}\n"
    for one in FACES:
        text += "  facet normal nan nan nan\n    outer loop\n"
        text += "".join(f"      vertex {line}\n" for line in rows([VERTICES[i] for i in one]).splitlines())
        text += "    endloop\n  endfacet\n"
    return text + f"endsolid{name}\n"


def stl_binary(title=b"made by a test", count=len(FACES), vertices=VERTICES):
    data = title.ljust(80) + struct.pack("<I", count)
    for one in FACES:
        data += struct.pack("<12fH", 0, 0, 1, *(number for i in one for number in vertices[i]), 0)
    return data


def texts():
    """A file of each format that is text, with its shape."""
    return {
        "ply": (ply_text(), "mesh"), "pcd": (pcd_text(), "points"), "off": (off_text(), "mesh"), "obj": (obj_text(), "mesh"),
        "stl": (stl_text(), "surface"), "xyz": ("# points\n" + rows(), "points"),
        "csv": ("x,y,z\n" + rows().replace(" ", ","), "points"), "pts": ("5\n" + rows(after=" -17 255 0 0"), "points"),
    }


def binaries():
    """Files with binary data after a header of text, with their shapes."""
    return {
        "little.ply": (ply_binary("<"), "mesh"), "big.ply": (ply_binary(">", scalar="float32"), "mesh"),
        "double.ply": (ply_binary("<", scalar="double"), "mesh"), "bigdouble.ply": (ply_binary(">", scalar="float64"), "mesh"),
        "binary.pcd": (pcd_binary(), "points"), "compressed.pcd": (pcd_compressed(), "points"),
    }
