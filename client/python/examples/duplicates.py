# SPDX-License-Identifier: Apache-2.0
"""Finds scans of the same object in a folder.

    duplicates.py FOLDER            with a server of its own, whose data are forgotten
    duplicates.py FOLDER --server HOST:PORT --collection NAME

Every scan is searched for among the others. Two are taken for the same object if each says so of the other.
"""

from __future__ import annotations

import argparse
import sys
from contextlib import ExitStack
from typing import Dict, List, Optional, Sequence, Set

import shapedb

SAME = ("same_object", "same_object_bent")


Hits = Dict[str, shapedb.Hit]


def same_objects(collection: shapedb.Collection, keys: Sequence[str], neighbours: int) -> Dict[str, Hits]:
    """Of each shape the others that are the same object."""
    found: Dict[str, Hits] = {}
    for key, result in zip(keys, collection.search_batch(keys, k=neighbours, progress=None)):
        found[key] = {hit.key: hit for hit in result if hit.verdict in SAME}
    return found


def groups_of(same: Dict[str, Hits]) -> List[Set[str]]:
    """Shapes that hang together by pairs that agree."""
    groups: Dict[str, Set[str]] = {key: {key} for key in same}
    for key, others in same.items():
        for other in others:
            if key in same.get(other, {}) and groups[key] is not groups[other]:
                merged = groups[key] | groups[other]
                groups.update(dict.fromkeys(merged, merged))
    return sorted({id(group): group for group in groups.values() if len(group) > 1}.values(), key=min)


def main(arguments: Optional[Sequence[str]] = None) -> int:
    parser = argparse.ArgumentParser(description="Finds scans of the same object in a folder.")
    parser.add_argument("folder")
    parser.add_argument("--server", help="a server to use in place of one of its own")
    parser.add_argument("--collection", default="duplicates", help="where the scans are stored [duplicates]")
    parser.add_argument("--neighbours", type=int, default=5, help="duplicates looked for of each scan [5]")
    options = parser.parse_args(arguments)
    with ExitStack() as stack:
        client: shapedb.Client = shapedb.Client(options.server) if options.server else shapedb.local()
        stack.enter_context(client)
        collection = client.create_collection(options.collection, exist_ok=True)
        added = collection.add_many(options.folder)  # what an earlier run has stored is not sent again
        for key, error in added.errors.items():
            print(f"{key}: {error}", file=sys.stderr)
        collection.wait_until_ready()
        keys = [shape.key for shape in collection.get_many(sorted(added.outcomes)).shapes if shape.state == "ready"]
        same = same_objects(collection, keys, options.neighbours)
        groups = groups_of(same)
        for group in groups:
            first, *others = sorted(group)
            print(first)
            for other in others:
                hit = same[first].get(other)
                print(f"  = {other}" + ("" if hit is None else f"  {hit.score:.3f}" + (", mirrored" * bool(hit.mirrored))))
        print(f"{len(keys)} scans, {len(groups)} objects with more than one")
    return 1 if added.errors else 0


if __name__ == "__main__":
    sys.exit(main())
