# SPDX-License-Identifier: Apache-2.0
"""Meshes from trimesh and back: files of all its formats can be stored, and what is found is laid on the query.

    trimesh_interop.py FOLDER QUERY         writes QUERY.found.ply: the mesh that is most like QUERY, laid on it

Needs trimesh (`pip install trimesh`), which reads glTF, 3MF, OFF, DAE and others.
"""

from __future__ import annotations

import argparse
import sys
from functools import partial
from pathlib import Path
from typing import Iterator, Optional, Sequence

import shapedb
import trimesh


def scans(folder: Path) -> Iterator[shapedb.Item]:
    """Every mesh in a folder; read when its turn comes."""
    for path in sorted(folder.iterdir()):
        if path.suffix.lower().lstrip(".") in trimesh.available_formats():
            yield shapedb.Item(path.name, partial(trimesh.load, path, force="mesh"))


def main(arguments: Optional[Sequence[str]] = None) -> int:
    parser = argparse.ArgumentParser(description="Finds the mesh most like another, and lays it on that.")
    parser.add_argument("folder", type=Path)
    parser.add_argument("query", type=Path)
    options = parser.parse_args(arguments)
    with shapedb.local() as client:
        collection = client.create_collection("meshes")
        collection.add_many(scans(options.folder)).raise_for_errors()
        collection.wait_until_ready()
        hit = collection.search(trimesh.load(options.query, force="mesh"), k=1)[0]
        print(hit.why)
        found = trimesh.load(options.folder / hit.key, force="mesh")
        found.apply_transform(hit.motion)
        found.export(str(options.query) + ".found.ply")
    return 0


if __name__ == "__main__":
    sys.exit(main())
