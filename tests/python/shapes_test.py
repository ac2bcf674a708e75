# SPDX-License-Identifier: Apache-2.0
"""Collections and shapes on a live server: what is stored is what comes back."""

import datetime
import threading

import hypothesis
import hypothesis.strategies as st
import numpy as np
import pytest
import shapedb

import solids
from conftest import QUICK


def reason_of(call, *args, **options):
    with pytest.raises(shapedb.ShapeDBError) as error:
        call(*args, **options)
    return error.value.reason


@pytest.fixture(scope="module")
def stored(client):
    """Six shapes to read only; f is flat and failed... nothing here fails, but one is labelled otherwise."""
    made = client.create_collection("stored", parameters=QUICK, exist_ok=True)
    made.add_many([(f"shape/{n}", solids.ball(100, seed=n), {"n": n, "label": "odd" if n % 2 else "even"})
                   for n in range(6)], progress=False).raise_for_errors()
    made.wait_until_ready()
    return made


def test_a_shape_and_its_life(collection):
    points = solids.box(300)
    added = collection.add("box", points, metadata={"label": "crate", "weight": 2.5})
    assert added.outcome == "created" and added.shape.key == "box" and added.shape.version == 1
    assert collection.wait("box", timeout=60).state == "ready"
    shape = collection.get("box")
    assert shape.state == "ready" and shape.metadata == {"label": "crate", "weight": "2.5"} and shape.label == "crate"
    assert added.shape.change == shape.change == 0, "one server"
    assert shape.point_count == 300 and 0 < shape.quality <= 1 and len(shape.sha256) == 32 and shape.failure is None
    assert abs(shape.created - datetime.datetime.now(datetime.timezone.utc)) < datetime.timedelta(minutes=5)
    np.testing.assert_array_equal(collection.points("box"), points.astype(np.float32))
    assert collection.add("box", points).outcome == "unchanged"
    assert collection.add("box", points, metadata={"label": "box"}).outcome == "metadata_changed"
    replaced = collection.add("box", solids.box(200), expected_version=2)
    assert replaced.outcome == "replaced" and replaced.shape.metadata == {"label": "box"}
    assert reason_of(collection.add, "box", points, expected_version=1) == "version_conflict"
    assert reason_of(collection.add, "box", points, mode="insert_only") == "already_exists"
    assert reason_of(collection.add, "box", points, mode="same_points") == "already_exists"
    assert reason_of(collection.add, "other", points, mode="update_only") == "not_found"
    assert collection.add("box", solids.box(200), metadata={}).shape.metadata == {}
    assert reason_of(collection.delete, "box", expected_version=77) == "version_conflict"
    assert collection.exists("box") and collection.delete("box").key == "box" and not collection.exists("box")
    assert reason_of(collection.get, "box") == "not_found"


@pytest.mark.parametrize("arguments, reason", [
    ({"metadata": {"a": object()}}, "invalid_argument"), ({"metadata": {"a": True}}, "invalid_argument"),
    ({"metadata": {"a b": "x"}}, "invalid_argument"), ({"metadata": {"shapedb.offset": "1 2 3"}}, "invalid_argument"),
    ({"mode": "overwrite"}, "invalid_argument"), ({"key": ""}, "invalid_argument"),
    ({"key": 7}, "invalid_argument"), ({"key": "\udcff"}, "invalid_argument"), ({"key": None}, "invalid_argument"),
    ({"metadata": {"a": "\udcff"}}, "invalid_argument"), ({"metadata": {7: "x"}}, "invalid_argument"),
    ({"scan": [(0, 0, 0)] * 10}, "all_points_equal"), ({"scan": np.eye(3)}, "too_few_points"),
    ({"scan": [(i, 0, 0) for i in range(9)]}, "collinear"), ({"scan": [(i, i * i, 0) for i in range(9)]}, "coplanar"),
    ({"scan": "nothing.npy"}, "file_not_readable"), ({"scan": "scan.las"}, "unknown_file_format"),
])
def test_what_cannot_be_stored_is_refused(collection, arguments, reason):
    given = {"key": "x", "scan": solids.box(100), **arguments}
    assert reason_of(collection.add, given.pop("key"), given.pop("scan"), **given) == reason
    assert collection.count() == 0


texts = st.text(st.characters(blacklist_categories=("Cc", "Cs", "Cf", "Zl", "Zp", "Co", "Cn")), min_size=1, max_size=40)


@hypothesis.settings(max_examples=15)
@hypothesis.given(key=texts, value=st.text(st.characters(blacklist_categories=("Cc", "Cs")), max_size=60))
def test_any_key_and_any_value(client, key, value):
    collection = client.create_collection("texts", parameters=QUICK, exist_ok=True)
    collection.add(key, solids.ball(20), metadata={"value": value})
    assert collection.get(key).metadata == {"value": value}
    assert [shape.key for shape in collection.shapes(filter=f"value={shapedb.quote(value)}")] == [key]
    collection.delete(key)


def test_reading_many(stored):
    keys = [f"shape/{n}" for n in range(6)]
    found = stored.get_many([keys[3], "none", keys[0]])
    assert [shape.key for shape in found.shapes] == [keys[3], keys[0]] and found.missing == ("none",)
    many = stored.get_many(keys * 400)
    assert len(many.shapes) == 2400
    assert [shape.key for shape in stored.shapes()] == keys
    assert [shape.key for shape in stored.shapes(order="key", descending=True, page_size=2)] == keys[::-1]
    assert [shape.key for shape in stored.shapes(filter="label=odd, n>=3", state="ready")] == [keys[3], keys[5]]
    assert [shape.key for shape in stored.shapes(key_prefix="shape/2")] == [keys[2]]
    page = stored.page(page_size=4)
    assert len(page.shapes) == 4 and len(stored.page(page_size=4, cursor=page.next_cursor).shapes) == 2
    assert stored.count() == 6 and stored.count(filter="label=odd") == 3 and stored.count(state="failed") == 0
    counts = stored.count_by_value("label")
    assert counts.values == {"even": 3, "odd": 3} and counts.without == 0
    assert stored.count_by_value("n", max_values=2).other_values == 4
    for wrong in ({"order": "size"}, {"state": "new"}, {"page_size": 5000}):
        assert reason_of(stored.page, **wrong) == "invalid_argument"
    assert reason_of(stored.page, filter="a b") == "malformed_filter"
    assert reason_of(stored.page, cursor="x") == "malformed_cursor"
    assert reason_of(stored.get_many, ["x" * 600]) == "invalid_argument"


def test_changing_many(collection):
    collection.add_many({f"s{n}": solids.ball(60, seed=n) for n in range(5)}, progress=False).raise_for_errors()
    changed = collection.update_metadata("s0", {"label": "cup", "year": 1990})
    assert changed.changed == 1 and changed.shape.metadata == {"label": "cup", "year": "1990"}
    assert collection.update_metadata("s0", remove=["year"]).shape.metadata == {"label": "cup"}
    assert collection.update_metadata("s0", {"a": "b"}, replace_all=True).shape.metadata == {"a": "b"}
    assert reason_of(collection.update_metadata, "s0", {"a": "c"}, expected_version=1) == "version_conflict"
    all_of_them = collection.update_metadata_where("", {"seen": "yes"})
    assert all_of_them.changed == 5 and collection.update_metadata_where("seen", {"seen": "yes"}).unchanged == 5
    deleted = collection.delete_many(["s1", "none"])
    assert deleted.count == 1 and deleted.missing == ("none",)
    assert collection.delete_many(filter="a").count == 1 and collection.count() == 3
    assert reason_of(collection.delete_many) == "invalid_argument"
    assert reason_of(collection.delete_many, "s2") == "invalid_argument"
    assert reason_of(collection.delete_many, ["s2"], filter="a") == "invalid_argument"
    assert collection.delete_many(filter="").count == 3


def test_failed_shapes_are_tried_again(client):
    # As published, a surface that is open has no interior.
    collection = client.create_collection("failing", profile="paper")
    upper = solids.ball(400)
    collection.add("half", upper[upper[:, 2] > 0.2], wait=True)
    shape = collection.get("half")
    if shape.state == "failed":
        assert shape.failure.reason == "no_interior" and shape.failure.message
        assert collection.retry(["half", "none"]).missing == ("none",)
        assert collection.wait("half").state == "failed"
        assert collection.retry(filter="").queued == 1
    assert collection.retry(["half"]).not_failed in ((), ("half",))


def test_collections(client):
    made = client.create_collection("bolts", description="steel", unit="mm",
                                    parameters=shapedb.Parameters(views=False, max_points=9))
    info = made.info()
    assert (info.name, info.description, info.profile, info.shapes, info.pending) == ("bolts", "steel", "default", 0, 0)
    assert info.parameters.unit == "mm" and info.parameters.max_points == 9 and info.parameters.views is False
    assert info.parameters.big_ball_ratio == 0.5 and info.parameters.interior_method == "adaptive"
    assert reason_of(client.create_collection, "bolts") == "already_exists"
    assert client.create_collection("bolts", exist_ok=True).info() == info
    assert client.create_collection("plain", profile="paper").info().profile == "paper"
    client.set_alias("screws", "bolts")
    assert client.collection("screws").info().aliases == ("screws",)
    client.rename_collection("bolts", "nuts")
    assert reason_of(made.info) == "not_found" and client.collection("screws").info().name == "nuts"
    client.delete_alias("screws")
    assert {"default", "nuts", "plain"} <= {info.name for info in client.collections()}
    client.collection("nuts").add("x", solids.box(100))
    assert reason_of(client.collection("nuts").drop) == "rejected"
    client.collection("nuts").drop(force=True)
    client.delete_collection("plain")
    for wrong in ({"unit": "furlong"}, {"profile": "new"}, {"parameters": shapedb.Parameters(max_points=99)},
                  {"parameters": shapedb.Parameters(thinning="much")}):
        assert reason_of(client.create_collection, "wrong", **wrong) == "invalid_argument"


def test_segments(client, collection):
    points = solids.hammer()
    segmentation = client.segment(points)
    assert segmentation.points.shape == points.shape and segmentation.segments.shape == (len(points),)
    np.testing.assert_array_equal(segmentation.points, points.astype(np.float32))
    assert -1 <= segmentation.segments.min() and segmentation.segments.max() >= 1
    assert segmentation.report.segments >= 2 and segmentation.report.stages["delaunay"] >= 0
    assert segmentation.report.interior_source in ("walk", "potential") and segmentation.report.doubt == "none"
    summary = client.segment(points, summary_only=True, profile="paper", parameters=shapedb.Parameters(max_points=1))
    assert len(summary.points) == 0 and len(summary.signature.points) == 1
    far = points + 1e6
    collection.add("far", far, wait=True)
    stored = collection.segments("far")
    np.testing.assert_allclose(stored.points, far, rtol=0, atol=1e-5)
    assert far.min(axis=0)[0] < stored.signature.points[0].position[0] < far.max(axis=0)[0]


def test_what_an_object_stands_on_is_left_out(collection):
    box = solids.box(1500, (1.0, 1.0, 1.0)) + (0, 0, 0.5)
    table = np.column_stack([np.random.default_rng(1).uniform(-3, 3, (4000, 2)), np.zeros(4000)])
    scan = np.concatenate([box, table])
    assert collection.add("box", scan, drop_plane=True).shape.point_count < 2000
    assert collection.add("all", scan).shape.point_count == len(scan)


def test_one_client_for_many_threads(stored):
    failures = []

    def work(seed):
        try:
            for _ in range(5):
                assert stored.get(f"shape/{seed % 6}").key == f"shape/{seed % 6}"
                assert stored.search(solids.ball(100, seed=seed % 6), k=1, verify=False)[0].score > 0.9
        except Exception as error:
            failures.append(error)

    threads = [threading.Thread(target=work, args=(seed,)) for seed in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not failures


def test_progress_is_told_and_a_broken_listener_does_no_harm(collection, caplog):
    told = []
    points = np.random.default_rng(1).normal(size=(200_000, 3))
    collection.add("cloud", points, progress=told.append)
    assert told[-1] == shapedb.Progress("upload", 2_400_000, 2_400_000) and len(told) == 3

    def broken(progress):
        raise RuntimeError("not today")

    assert collection.add("cloud", points, progress=broken).outcome == "unchanged"
    assert "not today" in caplog.text
    collection.delete("cloud")


def test_previews_are_some_points_of_many_shapes(client):
    previews = client.create_collection("previewed").previews
    collection = client.collection("previewed")
    for key in ("box", "ball"):
        collection.add(key, getattr(solids, key)(3000), wait=True)
    ball, box = previews(["ball", "none", "box"])
    assert (ball.key, box.key) == ("ball", "box") and ball.version == collection.get("ball").version
    assert 100 < len(ball.points) <= 1500 and ball.points.shape == ball.normals.shape
    assert np.abs(np.linalg.norm(ball.normals, axis=1) - 1.0).max() < 0.02
    (few,) = previews(["box"], max_points=50)
    assert 0 < len(few.points) <= 50
    for keys, options in (([], {}), (["box"], {"max_points": -1}), ("box", {})):
        with pytest.raises(shapedb.ShapeDBError) as error:
            previews(keys, **options)
        assert error.value.reason == "invalid_argument"


def test_a_collection_has_a_name(client):
    for call in (client.collection, client.delete_collection, client.create_collection):
        with pytest.raises(shapedb.InvalidInput, match="is empty"):
            call("")


def test_text_that_is_not_utf8_is_refused_wherever_it_enters(client):
    collection, bad = client.collection("x"), "caf\udce9"
    for call in (lambda: client.collection(bad), lambda: client.create_collection("a", description=bad),
                 lambda: client.rename_collection("a", bad), lambda: client.set_alias(bad, "x"),
                 lambda: client.import_collection("none", bad), lambda: client.create_key(bad, "reader"),
                 lambda: client.create_key("n", "reader", collections=[bad]), lambda: client.revoke_key(bad),
                 lambda: client.health(bad), lambda: collection.get(bad), lambda: collection.previews([bad]),
                 lambda: list(collection.shapes(key_prefix=bad)), lambda: collection.page(cursor=bad),
                 lambda: collection.count(key_prefix=bad), lambda: collection.count_by_value(bad),
                 lambda: collection.count_by_value("a", filter=bad), lambda: collection.update_metadata("a", {bad: 1}),
                 lambda: collection.update_metadata("a", {"b": bad}), lambda: collection.update_metadata("a", remove=[bad]),
                 lambda: collection.search(key="a", group_by=bad), lambda: collection.search_batch([bad]),
                 lambda: collection.compare("a", "b", other_collection=bad)):
        with pytest.raises(shapedb.InvalidInput, match="is not UTF-8"):
            call()
