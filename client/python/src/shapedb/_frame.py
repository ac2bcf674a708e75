# SPDX-License-Identifier: Apache-2.0
"""Results as pandas data frames; pandas is only needed here."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Dict, Iterable, Sequence

if TYPE_CHECKING:
    import pandas

    from ._search_types import Hit
    from ._types import Shape


def hits_frame(hits: Sequence["Hit"]) -> "pandas.DataFrame":
    """One row for each hit."""
    import pandas
    columns = ["rank", "key", "label", "score", "verdict", "verdict_reliability", "mirrored", "signature_score",
               "group"]
    rows = [{"rank": rank, **{name: getattr(hit, name) for name in columns[1:]}, **_metadata(hit.metadata)}
            for rank, hit in enumerate(hits, 1)]
    return pandas.DataFrame(rows) if rows else pandas.DataFrame(columns=columns)


def shapes_frame(shapes: Iterable["Shape"]) -> "pandas.DataFrame":
    """One row for each shape, the metadata in columns "metadata.KEY". Needs pandas."""
    import pandas
    columns = ["key", "label", "state", "point_count", "quality", "version", "created", "updated"]
    rows = [{**{name: getattr(shape, name) for name in columns}, **_metadata(shape.metadata)} for shape in shapes]
    return pandas.DataFrame(rows) if rows else pandas.DataFrame(columns=columns)


def _metadata(metadata: Dict[str, str]) -> Dict[str, Any]:
    return {"metadata." + key: value for key, value in metadata.items()}
