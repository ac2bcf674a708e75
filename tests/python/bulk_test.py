# SPDX-License-Identifier: Apache-2.0
"""Many uploads: errors that do not stop the others, errors that do, resuming, and Ctrl-C."""

import asyncio
import io
import signal
import subprocess
import sys
import time

import grpc
import numpy as np
import pytest
import shapedb
from shapedb._progress import Bar, line
from shapedb.v1 import shape_service_pb2 as pb

import solids
from fake import Fake, fails


def folder_of_scans(folder):
    for name, seed in (("cups/a", 1), ("cups/b", 2), ("bolts/a", 3)):
        path = folder / (name + ".npy")
        path.parent.mkdir(exist_ok=True)
        np.save(path, solids.ball(100, seed=seed))
    (folder / "README.txt").write_text("Scans of cups.\n")
    (folder / ".hidden.npy").write_text("")
    (folder / "image.png").write_text("")
    (folder / "bolts/points.txt").write_text("# x y z\n" + "\n".join("%f %f %f" % tuple(p) for p in solids.ball(50)))
    return folder


def test_a_folder_its_labels_and_its_keys(tmp_path):
    items = shapedb.scan_folder(folder_of_scans(tmp_path), label_from_folder=True,
                                metadata=lambda path: {"file": path.name})
    assert [item.key for item in items] == ["bolts/a", "bolts/points", "cups/a", "cups/b"]
    assert items[0].metadata == {"label": "bolts", "file": "a.npy"}
    (tmp_path / "cups/a.xyz").write_text("1 2 3\n")
    alike = [item.key for item in shapedb.scan_folder(tmp_path) if item.key.startswith("cups/")]
    assert alike == ["cups/a.npy", "cups/a.xyz", "cups/b"], "files of one name keep their endings"
    np.save(tmp_path / "cups/a.xyz.npy", solids.ball(10))
    with pytest.raises(shapedb.InvalidInput, match="same key"):
        shapedb.scan_folder(tmp_path)
    (tmp_path / "empty").mkdir()
    for folder in ("empty", "missing"):
        with pytest.raises(shapedb.ShapeDBError, match="file_not_readable"):
            shapedb.scan_folder(tmp_path / folder)


def test_adding_a_folder_and_resuming(collection, tmp_path):
    folder_of_scans(tmp_path)
    told = []
    result = collection.add_many(tmp_path, progress=told.append)
    assert len(result) == result.count("created") == 4 and not result.errors and result.raise_for_errors() is result
    assert told[-1] == shapedb.Progress("add", 4, 4) and [one.done for one in told] == [1, 2, 3, 4]
    assert collection.wait_until_ready(timeout=60).ready == 4
    np.save(tmp_path / "cups/a.npy", solids.ball(100, seed=9))
    again = collection.add_many(shapedb.scan_folder(tmp_path, label_from_folder=True), progress=False)
    assert again.outcomes == {"bolts/a": "metadata_changed", "bolts/points": "metadata_changed",
                              "cups/a": "replaced", "cups/b": "metadata_changed"}
    assert collection.add_many(shapedb.scan_folder(tmp_path, label_from_folder=True)).count("unchanged") == 4


def test_what_is_there_is_not_sent_again():
    points = solids.ball(30) + 1e6
    with Fake(pb.AddShapeResponse(outcome="OUTCOME_CREATED")) as server, shapedb.Client(server.address) as client:
        client.collection().add_many({"a": points, "b": points + 1}, resume=False, progress=False)
        assert len(server.uploads) == 2


def test_nothing_is_sent_to_resume(client, collection, monkeypatch):
    items = {f"s{n}": solids.ball(40, seed=n) + (1e6 if n % 2 else 0) for n in range(40)}
    assert collection.add_many(items, progress=False).count("created") == 40
    uploads = []
    run = client._transport.run

    def count_uploads(call, *arguments):
        uploads.append(call.rpc)
        return run(call, *arguments)

    monkeypatch.setattr(client._transport, "run", count_uploads)
    assert collection.add_many(items, progress=False).count("unchanged") == 40
    assert set(uploads) == {"ShapeService/GetShapes"} and len(uploads) == 3


def test_bad_scans_do_not_stop_the_others(collection):
    scans = {"good": solids.ball(50), "flat": [(i, i * i, 0) for i in range(9)], "nan": [(0, 0, float("nan"))] * 5,
             "file": "missing.npy", "late": lambda: solids.ball(50, seed=2), "": solids.ball(50)}
    result = collection.add_many(scans, progress=False)
    assert sorted(result.outcomes) == ["good", "late"]
    assert {key: error.reason for key, error in result.errors.items()} == {
        "flat": "coplanar", "nan": "non_finite_coordinate", "file": "file_not_readable", "": "invalid_argument"}
    with pytest.raises(shapedb.ShapeDBError, match="and 3 others failed"):
        result.raise_for_errors()


def test_what_every_scan_would_meet_ends_it(client):
    asked = []

    def items():
        for n in range(10_000):
            asked.append(n)
            yield f"s{n}", solids.ball(20)

    with pytest.raises(shapedb.ShapeDBError) as error:
        client.collection("missing").add_many(items(), progress=False, workers=2)
    assert error.value.reason == "not_found" and len(asked) < 200 and "0 were stored before" in error.value.message
    with pytest.raises(shapedb.InvalidInput, match="workers"):
        client.collection("missing").add_many([], workers=0)
    with pytest.raises(shapedb.InvalidInput, match="an item is"):
        client.collection("missing").add_many(["abc"])


def test_closing_the_client_ends_it(client, collection):
    other = shapedb.Client(client.address, environment={})

    def items():
        for n in range(10_000):
            yield f"s{n}", solids.ball(20, seed=n)
            if n == 200:
                other.close()

    with pytest.raises(shapedb.ShapeDBError, match="cancelled"):
        collection_of_other = other.collection(collection.name)
        collection_of_other.add_many(items(), progress=False)


def test_a_generator_that_fails_ends_it(collection):
    def items():
        yield "a", solids.ball(20)
        raise RuntimeError("no more")

    with pytest.raises(RuntimeError, match="no more"):
        collection.add_many(items(), progress=False)


def test_a_full_queue_is_waited_for():
    full = fails(grpc.StatusCode.RESOURCE_EXHAUSTED, "queue_full", pushback=10)
    with Fake(*[full] * 20, pb.AddShapeResponse(outcome="OUTCOME_CREATED")) as server:
        with shapedb.Client(server.address, timeout=0.1) as client:
            result = client.collection().add_many({"a": solids.ball(20)}, resume=False, progress=False)
        assert result.outcomes == {"a": "created"} and len(server.uploads) == 21


def test_the_same_for_asyncio(client, tmp_path):
    folder_of_scans(tmp_path)

    async def main():
        async with shapedb.AsyncClient(client.address) as other:
            collection = await other.create_collection("async-bulk")
            first = await collection.add_many(tmp_path, progress=False)
            again = await collection.add_many(tmp_path, progress=False)
            with pytest.raises(shapedb.ShapeDBError, match="not_found"):
                await other.collection("missing").add_many(tmp_path, progress=False)
            return first, again

    first, again = asyncio.run(main())
    assert first.count("created") == 4 and again.count("unchanged") == 4


def test_ctrl_c_and_again(client, collection):
    program = """
import sys, shapedb, solids
def items():
    for n in range(100_000):
        yield f"s{n}", solids.ball(40, seed=n)
        if n == 300:
            print("started", flush=True)
try:
    with shapedb.Client(sys.argv[1]) as client:
        client.collection(sys.argv[2]).add_many(items(), progress=False)
except KeyboardInterrupt:
    print("interrupted", flush=True)
"""
    process = subprocess.Popen([sys.executable, "-c", program, client.address, collection.name],
                               stdout=subprocess.PIPE, text=True, cwd=__file__.rsplit("/", 1)[0])
    assert process.stdout.readline() == "started\n"
    process.send_signal(signal.SIGINT)
    start = time.monotonic()
    output, _ = process.communicate(timeout=30)
    assert output == "interrupted\n" and process.returncode == 0 and time.monotonic() - start < 15
    stored = collection.count()
    assert stored > 0
    result = collection.add_many({f"s{n}": solids.ball(40, seed=n) for n in range(stored)}, progress=False)
    assert result.count("unchanged") >= stored - 16 * 4, "the workers leave gaps at the end"


def test_a_bar_draws_one_line():
    assert line(shapedb.Progress("add", 15, 60), 5.0).startswith("add  [#######") and \
        line(shapedb.Progress("add", 15, 60), 5.0).endswith("15/60  3/s  15 s left")
    assert line(shapedb.Progress("add", 15, 0), 5.0) == "add  15  3/s"
    out = io.StringIO()
    bar = Bar(out)
    for done in range(0, 101):
        bar(shapedb.Progress("add", done, 100))
    bar.close()
    assert out.getvalue().endswith("100/100\n")
    assert out.getvalue().count("\r") < 10
