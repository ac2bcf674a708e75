# SPDX-License-Identifier: Apache-2.0
"""Adding scans and searching for them, on a live server."""

import dataclasses
import math

import numpy as np
import pytest
import shapedb

import solids
from conftest import QUICK


SAME = ("same_object", "same_object_bent")


@pytest.fixture(scope="module")
def tools(client):
    """A collection to read only."""
    made = client.create_collection("tools", parameters=QUICK)
    scans = {"hammer": solids.hammer(), "ball": solids.ball(), "egg": solids.ball(axes=(1, 1, 2)),
             "box": solids.box(), "plank": solids.box(sides=(0.3, 1, 4))}
    for key, points in scans.items():
        metadata = {"label": "tool" if key == "hammer" else "solid", "points": len(points)}
        made.add(key, points, metadata=metadata, wait=True)
    return made


def moved(points, seed=5, scale=1.7, shift=(3.0, -2.0, 1.0)):
    motion = np.eye(4)
    motion[:3, :3] = scale * solids.rotation(seed)
    motion[:3, 3] = shift
    return shapedb.transform(points, motion)


def distances(points, others):
    """Of each point to the nearest of the others."""
    return np.sqrt(((points[:, None, :] - others[None, :, :])**2).sum(axis=2).min(axis=1))


def assert_lies_on(found, scan, share=0.02):
    size = np.linalg.norm(np.ptp(scan, axis=0))
    assert np.median(distances(found[::5], scan)) < share * size


def test_a_scan_finds_its_object(tools):
    query = moved(solids.hammer(seed=9))
    result = tools.search(query, k=3)
    assert len(result) == 3 and result[0].key == "hammer" and result[0].score > result[1].score
    assert result.candidates == result.filtered == 5 and result.pending == 0 and result.exact in (True, False)
    assert result[0].verdict in SAME and 0 < result[0].verdict_reliability <= 1
    assert result[0].label == "tool" and result[0].metadata["points"] == "1200"
    assert result.covered == 1.0
    assert result.report.points == len(query) and result.seconds_search > 0 and result.query.scale > 0
    assert [hit.key for hit in result[:2]] == [hit.key for hit in list(result)[:2]]


def test_the_motion_takes_the_hit_to_the_query(tools):
    query = moved(solids.hammer(seed=9))
    hit = tools.search(query, k=1)[0]
    assert hit.motion.shape == (4, 4) and hit.motion.dtype == np.float64
    assert abs(abs(np.linalg.det(hit.motion[:3, :3])) - 1.7**3) < 0.4
    assert_lies_on(shapedb.transform(tools.points("hammer"), hit.motion), query)
    np.testing.assert_array_equal(hit.motion, hit.fit.motion)


def test_scans_far_from_the_origin_stay_where_they_are(client, collection):
    far = np.array([4.5e6, 5.4e6, 120.0])
    stored = solids.hammer() + far
    collection.add("hammer", stored, metadata={"site": 7}, wait=True)
    np.testing.assert_allclose(collection.points("hammer"), stored, rtol=0, atol=1e-5)
    assert collection.get("hammer").metadata == {"site": "7"}
    query = moved(solids.hammer(seed=9)) - far
    hit = collection.search(query, k=1)[0]
    assert_lies_on(shapedb.transform(stored, hit.motion), query)
    fit = collection.align(query, "hammer")
    # Motions of stored shapes and scans alike.
    assert_lies_on(shapedb.transform(stored, client.align(query, stored).motion), query)
    assert fit.best.score > 0.3
    assert collection.add("hammer", stored).outcome == "unchanged"
    collection.add("hammer", solids.hammer(), wait=True)
    np.testing.assert_allclose(collection.points("hammer"), solids.hammer(), rtol=0, atol=1e-6)


def test_so_they_do_in_searches_by_key(collection):
    far = np.array([4.5e6, 5.4e6, 120.0])
    first, second = solids.hammer() + far, moved(solids.hammer(seed=9)) - far
    collection.add("first", first, wait=True)
    collection.add("second", second, wait=True)
    hit = collection.search(key="second", k=1)[0]
    assert_lies_on(shapedb.transform(first, hit.motion), second)
    assert_lies_on(shapedb.transform(first, collection.compare("second", "first").motion), second)
    low, high = first.min(axis=0), first.max(axis=0)
    position = collection.signature("first").points[0].position
    assert (low < position).all() and (position < high).all()


def test_what_is_returned_does_not_change(tools):
    hit = tools.search(solids.box(seed=3), k=1)[0]
    with pytest.raises(dataclasses.FrozenInstanceError):
        hit.score = 1.0
    with pytest.raises(ValueError):
        hit.motion[0, 0] = 1.0


def test_the_explanation_says_why(tools):
    hit = tools.search(solids.hammer(seed=9), k=1)[0]
    why = hit.why
    assert why.verdict in SAME and why.words.startswith("same object")
    assert {"chords", "parts", "fit"} <= {term.name for term in why.terms}
    assert math.isclose(sum(term.weight for term in why.terms), 1.0, abs_tol=1e-6)
    assert all(term.distance >= 0 for term in why.terms)
    assert why.matches and math.isclose(sum(match.share for match in why.matches), 1.0, abs_tol=1e-6)
    text = str(why)
    for words in ("hammer: same object", "parts of the query match", "part 1 <-> part", "Differences (0 = identical",
                  "of the query lies on hammer", "of the size of the query apart"):
        assert words in text, text
    assert tools.search(solids.hammer(seed=9), k=1, explain=False)[0].why is None


def test_an_answer_says_its_unit_and_what_it_cannot_tell(client, collection):
    assert collection.search(solids.hammer(), k=1).unit == "none"
    metres = client.create_collection(collection.name + "-m", parameters=shapedb.Parameters(unit="m"))
    try:
        metres.add("hammer", solids.hammer(), wait=True)
        metres.add("twin", solids.hammer() * [-1, 1, 1], wait=True)
        found = metres.search(solids.hammer(seed=9), k=2, reflection=False, verify=False)
        assert found.unit == "m" and found.left_right_untold
        assert not metres.search(solids.hammer(seed=9), k=2).left_right_untold
        assert metres.compare("hammer", "twin").unit == "m"
    finally:
        client.delete_collection(metres.name, force=True)


def test_by_key_signature_and_batch(tools):
    by_key = tools.search(key="egg", k=2)
    assert "egg" not in [hit.key for hit in by_key]
    with_self = tools.search(key="egg", k=1, include_self=True)
    assert with_self[0].key == "egg" and with_self[0].score == 1.0
    signature = tools.signature("egg")
    assert signature.points[0].volume_share > 0.5 and signature.statistics and signature.quality > 0.85
    assert tools.search(signature, k=1)[0].key == "egg"
    batch = tools.search_batch(["egg", signature, "box"], k=2, explain=True)
    assert len(batch) == 3 and batch[1][0].key == "egg"
    assert [hit.key for hit in batch[0]] == [hit.key for hit in by_key] and batch[0][0].why is not None
    told = []
    many = tools.search_batch(["box"] * 60, k=1, verify=False, progress=told.append)
    assert len(many) == 60 and len({result[0].key for result in many}) == 1
    assert told == [shapedb.Progress("search", done, 60) for done in (25, 50, 60)]


def test_from_a_file(tools, tmp_path):
    np.save(tmp_path / "scan.npy", solids.box(seed=4))
    assert tools.search(tmp_path / "scan.npy", k=1)[0].key == "box"
    assert tools.search(str(tmp_path / "scan.npy"), k=1)[0].key == "box"


def test_options_reach_the_server(tools):
    query = solids.hammer(seed=9)
    assert {hit.label for hit in tools.search(query, filter="label=solid")} == {"solid"}
    assert len(tools.search(query, k=2)) == 2
    assert all(hit.score >= 0.5 for hit in tools.search(query, threshold=0.5))
    grouped = tools.search(query, k=2, group_by="label", per_group=2)
    assert [group.value for group in grouped.groups] == ["tool", "solid"]
    assert [hit.group for hit in grouped] == ["tool", "solid", "solid"]
    unverified = tools.search(query, verify=False)
    assert unverified.verified == 0 and unverified[0].fit is None and unverified[0].verdict is None
    assert unverified[0].motion is not None and "verdict" not in str(unverified[0].why)
    assert tools.search(query, candidates=1).verified == 1
    partial = tools.search(query[query[:, 0] > -0.5], k=1, partial=True, one_sided=False)
    assert partial[0].key == "hammer" and "contained parts" in [term.name for term in partial[0].why.terms]
    mirrored = query * (-1, 1, 1)
    twin, itself = tools.search(mirrored, k=1), tools.search(query, k=1)
    assert itself[0].mirrored is False and tools.search(query, k=1, verify=False)[0].mirrored is None
    assert twin[0].mirrored == (twin[0].fit.best.reflected and not twin[0].fit.left_right_open)
    assert tools.search(mirrored, k=1)[0].score > tools.search(mirrored, k=1, reflection=False)[0].score
    smaller = 0.1 * query
    assert tools.search(smaller, k=1)[0].score > tools.search(smaller, k=1, keep_scale=True)[0].score


@pytest.mark.parametrize("options, reason", [
    ({"k": 0}, "invalid_argument"), ({"k": -1}, "invalid_argument"), ({"threshold": 2.0}, "invalid_argument"),
    ({"filter": "a b"}, "malformed_filter"), ({"viewpoint": (1, 2)}, "invalid_argument"),
    ({"keep_scale": True, "free_scale": True}, "invalid_argument"), ({"key": "none"}, "not_found"),
])
def test_bad_options_are_errors_with_a_name(tools, options, reason):
    query = None if "key" in options else solids.box()
    with pytest.raises(shapedb.ShapeDBError) as error:
        tools.search(query, **options)
    assert error.value.reason == reason


def test_a_search_needs_one_query(tools):
    with pytest.raises(shapedb.InvalidInput, match="either"):
        tools.search()
    with pytest.raises(shapedb.InvalidInput, match="either"):
        tools.search(solids.box(), key="box")
    with pytest.raises(shapedb.InvalidInput, match="list of keys"):
        tools.search_batch("box")


def test_comparing_and_aligning(client, tools):
    comparison = tools.compare("hammer", "egg")
    assert 0 <= comparison.score < 0.9 and comparison.verdict in ("unrelated", "same_kind")
    assert comparison.query.points and comparison.other.points and "egg" in str(comparison.why)
    assert tools.compare("egg", "egg").score == 1.0
    query = moved(solids.hammer(seed=9))
    fit = tools.align(query, "hammer")
    assert fit.kind == "whole" and fit.best.explained_query > 0.5 and "lies on" in str(fit)
    assert_lies_on(shapedb.transform(tools.points("hammer"), fit.motion), query)
    both = client.align(query, solids.hammer())
    assert_lies_on(shapedb.transform(solids.hammer(), both.motion), query)


def test_an_answer_is_a_table(tools):
    result = tools.search(solids.hammer(seed=9), k=2)
    lines = str(result).splitlines()
    assert lines[0].split() == ["rank", "score", "verdict", "label", "key"] and lines[1].split()[0] == "1"
    assert "<table>" in result._repr_html_() and "hammer" in result._repr_html_()
    assert str(tools.search(solids.box(), threshold=0.9999, filter="label=tool")) == "no hits"


def test_a_data_frame(tools):
    pytest.importorskip("pandas")
    frame = tools.search(solids.hammer(seed=9), k=2).to_dataframe()
    assert list(frame["rank"]) == [1, 2] and frame["key"][0] == "hammer" and frame["metadata.label"][0] == "tool"
    assert len(tools.search(solids.box(), threshold=0.9999, filter="label=tool").to_dataframe()) == 0
    shapes = shapedb.shapes_frame(tools.shapes(order="key"))
    assert list(shapes["key"]) == ["ball", "box", "egg", "hammer", "plank"] and (shapes["state"] == "ready").all()


def test_a_picture(tools, tmp_path):
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    query = solids.hammer(seed=9)
    hit = tools.search(query, k=1)[0]
    axes = tools.show(query, hit)
    assert len(axes.collections) == 2
    assert [text.get_text() for text in axes.get_legend().get_texts()] == ["query", "hammer"]
    axes.figure.savefig(tmp_path / "overlay.png")
    assert (tmp_path / "overlay.png").stat().st_size > 5000
    tools.show(query, "hammer", max_points=100)
    again = shapedb.show((tools.points("hammer"), hit.motion), solids.box(), ax=axes)
    assert again is axes
    with pytest.raises(shapedb.InvalidInput, match="no motion"):
        tools.show(query, tools.search(query, k=1, explain=False, verify=False)[0])
    matplotlib.pyplot.close("all")
