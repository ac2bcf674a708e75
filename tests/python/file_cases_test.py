# SPDX-License-Identifier: Apache-2.0
"""The files that all readers are held to: tests/support/file_cases/."""

import base64
import json
import random
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import shapedb
from shapedb._files import content_of

CORPUS = Path(__file__).parent.parent / "support" / "file_cases"
DOCUMENT = json.loads((CORPUS / "cases.json").read_text())
REASONS = {"malformed_file", "non_finite_coordinate", "coordinate_out_of_range", "unknown_file_format"}


def bytes_of(case):
    return case["text"].encode() if "text" in case else base64.b64decode(case["base64"])


def test_the_files_are_what_the_script_makes():
    subprocess.run([sys.executable, str(CORPUS / "make.py"), "--check"], check=True)


def test_each_is_read_or_refused_as_by_all_readers():
    wrong = []
    for case in DOCUMENT["cases"]:
        try:
            check_read(case) if "reads" in case else check_refused(case)
        except (AssertionError, shapedb.ShapeDBError) as error:
            wrong.append(f"{case['name']}: {error}")
    assert wrong == []


def check_read(case):
    shape = DOCUMENT["shapes"][case["reads"]]
    content = content_of(case["file"], bytes_of(case))
    np.testing.assert_array_equal(content.vertices, np.array(shape["vertices"]).reshape(-1, 3))
    np.testing.assert_array_equal(content.triangles, np.array(shape["triangles"], dtype=int).reshape(-1, 3))
    assert content.skipped == case.get("skipped", 0)
    assert content.ignored == ([case["ignored"]] if "ignored" in case else [])


def check_refused(case):
    with pytest.raises(shapedb.ShapeDBError) as refused:
        content_of(case["file"], bytes_of(case))
    error = refused.value
    assert error.reason == case["refused"], error.message
    for part in [f"{case['file']}: ", *case["says"]]:
        assert part in error.message, f"'{error.message}' lacks '{part}'"


def plain_cases():
    return [case for case in DOCUMENT["cases"] if re.search(r" (plain|packed)|^(ply: a grid|pcd: padding|off: CNOFF on)", case["name"])
            and len(bytes_of(case)) < 3000]


def test_what_is_cut_short_or_damaged_anywhere_is_read_or_refused_in_words():
    numbers = random.Random(7)

    def sane(case, data):
        try:
            content_of(case["file"], data)
        except shapedb.ShapeDBError as error:
            assert error.reason in REASONS, error
            assert error.message.isascii() and error.message.isprintable(), error

    cases = plain_cases()
    assert len(cases) > 20
    for case in cases:
        data = bytes_of(case)
        for end in range(len(data)):
            sane(case, data[:end])
        for _ in range(100):
            changed = bytearray(data)
            for _ in range(numbers.randint(1, 4)):
                changed[numbers.randrange(len(data))] = numbers.choice((numbers.randrange(256), 48 + numbers.randrange(10)))
            sane(case, bytes(changed))


def test_large_files_are_read_as_small_ones_are():
    """The fast way for plain rows goes on where it has to stop."""
    count = 70_000
    points = np.random.default_rng(1).normal(size=(count, 3)).round(4)
    rows = [" ".join(map(str, row)) for row in points]
    odd = [*rows[:66_000], "# a comment", *rows[66_000:]]
    faces = [f"3 {i} {i + 1} {i + 2}" for i in range(count - 2)]
    header = ["ply", "format ascii 1.0", f"element vertex {count}", *(f"property double {axis}" for axis in "xyz")]
    files = {
        "a.xyz": odd, "b.xyz": rows, "a.off": [f"OFF {count} {count - 2} 0", *odd, *faces],
        "a.ply": [*header, f"element face {count - 2}", "property list uchar int vertex_indices", "end_header", *odd, *faces],
        "a.pcd": ["FIELDS x y z", "SIZE 8 8 8", f"POINTS {count}", "DATA ascii", *odd], "a.obj": [f"v {row}" for row in rows],
    }
    for name, lines in files.items():
        for end in ("\n", "\r\n"):
            content = content_of(name, (end.join(lines) + end).encode())
            np.testing.assert_array_equal(content.vertices, points, name)
            assert len(content.triangles) == (count - 2 if name in ("a.off", "a.ply") else 0)
    bad = [*rows[:69_000], "1 2", *rows[69_000:]]
    with pytest.raises(shapedb.InvalidInput, match="line 69001: .*found nothing"):
        content_of("bad.xyz", "\n".join(bad).encode())


def test_what_is_passed_over_is_told(tmp_path):
    case = next(case for case in DOCUMENT["cases"] if "ignored" in case)
    (tmp_path / case["file"]).write_bytes(bytes_of(case))
    with pytest.warns(UserWarning, match=f"passed over: {case['ignored']}"):
        shapedb.read_scan(tmp_path / case["file"])


def test_folders_are_searched_for_all_of_them(tmp_path):
    for case in plain_cases():
        if " packed" not in case["name"]:
            folder = tmp_path / case["name"].split(":")[0]
            folder.mkdir(exist_ok=True)
            (folder / case["file"]).write_bytes(bytes_of(case))
    (tmp_path / "ply" / "README.txt").write_text("1 scan of a cup, 2 of a mug\n")
    (tmp_path / "ply" / "packed.ply.gz").write_bytes(bytes_of(next(c for c in DOCUMENT["cases"] if c["name"] == "ply: .gz after the ending")))
    keys = {item.key for item in shapedb.scan_folder(tmp_path)}
    assert {"ply/a", "ply/packed", "pcd/a", "off/a", "csv/a"} <= keys and not any("README" in key for key in keys)
