# SPDX-License-Identifier: Apache-2.0
"""A collection is a mapping: under any series of changes it holds what a dictionary would."""

import hypothesis
import hypothesis.strategies as st
import pytest
import shapedb

import solids
from conftest import QUICK

KEYS = st.sampled_from(["a", "b", "c/d", "é"])
METADATA = st.dictionaries(st.sampled_from(["label", "year", "x.y"]), st.text("ab 1,=\"", max_size=4), max_size=3)
CHANGES = st.one_of(
    st.tuples(st.just("add"), KEYS, st.none() | METADATA, st.integers(0, 2)),
    st.tuples(st.just("update"), KEYS, METADATA, st.booleans()),
    st.tuples(st.just("update_where"), st.sampled_from(["label", "year"]), METADATA),
    st.tuples(st.just("delete"), KEYS),
    st.tuples(st.just("delete_where"), st.sampled_from(["label", "x.y"])),
)


def apply(change, collection, model):
    """To both. The model is {key: (metadata, which points)}."""
    name, *arguments = change
    if name == "add":
        key, metadata, which = arguments
        before = model.get(key)
        added = collection.add(key, solids.ball(12, seed=which + 1), metadata=metadata)
        model[key] = ((before[0] if before else {}) if metadata is None else metadata, which)
        expected = ("created" if before is None else "replaced" if before[1] != which else
                    "unchanged" if before == model[key] else "metadata_changed")
        # A shape whose segmentation has failed meanwhile is tried again.
        assert added.outcome in (expected, "retried"), change
    elif name == "update":
        key, metadata, replace = arguments
        if key not in model:
            with pytest.raises(shapedb.ShapeDBError, match="not_found"):
                collection.update_metadata(key, metadata, replace_all=replace)
            return
        model[key] = (metadata if replace else {**model[key][0], **metadata}, model[key][1])
        assert collection.update_metadata(key, metadata, replace_all=replace).shape.metadata == model[key][0]
    elif name == "update_where":
        label, metadata = arguments
        passing = {key: value for key, value in model.items() if label in value[0]}
        model.update({key: ({**old, **metadata}, which) for key, (old, which) in passing.items()})
        result = collection.update_metadata_where(label, metadata)
        assert result.changed + result.unchanged == len(passing) and result.refused == 0
    elif name == "delete":
        if model.pop(arguments[0], None) is not None:
            assert collection.delete(arguments[0]).key == arguments[0]
        else:
            assert collection.delete_many([arguments[0]]).missing == (arguments[0],)
    else:
        passing = [key for key, value in model.items() if arguments[0] in value[0]]
        assert collection.delete_many(filter=arguments[0]).count == len(passing)
        for key in passing:
            del model[key]


@hypothesis.settings(max_examples=20)
@hypothesis.given(st.lists(CHANGES, min_size=3, max_size=15))
def test_a_collection_is_a_mapping(client, changes):
    collection = client.create_collection("model", parameters=QUICK, exist_ok=True)
    collection.delete_many(filter="")
    model = {}
    for change in changes:
        apply(change, collection, model)
    assert {shape.key: shape.metadata for shape in collection.shapes(page_size=2)} == \
        {key: metadata for key, (metadata, _) in model.items()}
    assert [shape.key for shape in collection.shapes(order="key")] == sorted(model, key=str.encode)
    assert collection.count() == len(model)
    labels = [metadata["label"] for metadata, _ in model.values() if "label" in metadata]
    counts = collection.count_by_value("label")
    assert counts.values == {label: labels.count(label) for label in labels}
    assert counts.without == len(model) - len(labels)
    for label in set(labels):
        assert collection.count(filter=f"label={shapedb.quote(label)}") == labels.count(label)
