# SPDX-License-Identifier: Apache-2.0
"""Gives unlabelled shapes of a collection the labels of those they look like.

    carry_labels.py HOST:PORT COLLECTION            says what it would do
    carry_labels.py HOST:PORT COLLECTION --write

A label is carried over if the nearest labelled shapes agree on it and the best of them is of the same kind at least. It
is written with `label.from`, the shape that it comes from, and `label.score`, so that people can look it over:

    shapedb list --collection COLLECTION --filter 'label.from, label.score<0.6'
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from typing import Iterator, NamedTuple, Optional, Sequence

import shapedb


class Proposal(NamedTuple):
    """A label for a shape."""

    key: str
    label: Optional[str]
    hit: Optional[shapedb.Hit]


def proposals(collection: shapedb.Collection, neighbours: int) -> Iterator[Proposal]:
    """For every shape without a label."""
    keys = [shape.key for shape in collection.shapes(filter="!label", state="ready")]
    for key, result in zip(keys, collection.search_batch(keys, k=neighbours, filter="label")):
        alike = [hit for hit in result if hit.verdict not in (None, "unrelated")]
        votes = Counter(hit.label for hit in alike)
        label, count = votes.most_common(1)[0] if votes else (None, 0)
        best = next((hit for hit in alike if hit.label == label), None)
        yield Proposal(key, label if 2 * count > len(alike) else None, best)


def main(arguments: Optional[Sequence[str]] = None) -> int:
    parser = argparse.ArgumentParser(description="Gives unlabelled shapes the labels of those they look like.")
    parser.add_argument("server")
    parser.add_argument("collection")
    parser.add_argument("--neighbours", type=int, default=3, help="labelled shapes that are asked [3]")
    parser.add_argument("--write", action="store_true", help="write the labels, not only say them")
    options = parser.parse_args(arguments)
    labelled = total = 0
    with shapedb.Client(options.server) as client:
        collection = client.collection(options.collection)
        for proposal in list(proposals(collection, options.neighbours)):
            total += 1
            if proposal.label is None or proposal.hit is None:
                print(f"{proposal.key}: no label")
                continue
            labelled += 1
            hit = proposal.hit
            print(f"{proposal.key}: {proposal.label} (like {hit.key}, {hit.score:.2f})")
            if options.write:
                collection.update_metadata(proposal.key, {"label": proposal.label, "label.from": hit.key,
                                                          "label.score": round(hit.score, 3)})
    print(f"{labelled} of {total} unlabelled shapes look like labelled ones")
    return 0


if __name__ == "__main__":
    sys.exit(main())
