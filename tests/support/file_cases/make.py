#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes cases.json: small scan files of every format, in all the ways that programs write them, and what each holds.

The readers of the command, of the Python package and of the web page are all held to it, so that they agree: each reads
the same points and triangles, or refuses the file for the same reason, at the same place.

    make.py            writes cases.json
    make.py --check    says whether it is what would be written
    make.py FOLDER     writes the files themselves there, to be tried by hand
"""

import base64
import json
import sys
from pathlib import Path

import kinds_of_binary
import kinds_of_format
import kinds_of_text
from shapes import SHAPES

HERE = Path(__file__).parent


def content(data):
    """As text where it can be read."""
    if all(byte in b"\t\n\r" or 32 <= byte < 127 for byte in data):
        return {"text": data.decode()}
    return {"base64": base64.b64encode(data).decode()}


def all_cases():
    cases = [case for kinds in (kinds_of_text, kinds_of_binary, kinds_of_format) for case in kinds.cases()]
    names = [case.name for case in cases]
    assert len(set(names)) == len(names), sorted({name for name in names if names.count(name) > 1})
    return cases


def document(cases):
    rows = []
    for case in cases:
        row = {"name": case.name, "file": case.file, **content(case.data), **case.outcome}
        rows.append("  " + json.dumps(row, ensure_ascii=True))
    shapes = ",\n".join(f"  {json.dumps(name)}: {json.dumps(shape)}" for name, shape in SHAPES.items())
    return '{"shapes": {\n' + shapes + '\n},\n"cases": [\n' + ",\n".join(rows) + "\n]}\n"


def main():
    cases = all_cases()
    text = document(cases)
    target = HERE / "cases.json"
    if sys.argv[1:] == ["--check"]:
        if target.read_text() != text:
            sys.exit("cases.json is not what make.py makes: run it")
    elif sys.argv[1:]:
        folder = Path(sys.argv[1])
        folder.mkdir(parents=True, exist_ok=True)
        for number, case in enumerate(cases):
            (folder / f"{number:03}-{case.file}").write_bytes(case.data)
    else:
        target.write_text(text)
        print(f"{len(cases)} files")


if __name__ == "__main__":
    main()
