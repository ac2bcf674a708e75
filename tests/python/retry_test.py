# SPDX-License-Identifier: Apache-2.0
"""Retries, deadlines and the names of errors, against a server that fails as it is told."""

import asyncio
import math
import re
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import grpc
import pytest
import shapedb
from shapedb._errors import Failure
from shapedb.v1 import shape_service_pb2 as pb

import solids
from fake import COUNTED, Fake, fails

UNAVAILABLE = fails(grpc.StatusCode.UNAVAILABLE, "unavailable")
FULL = fails(grpc.StatusCode.RESOURCE_EXHAUSTED, "queue_full", pushback=30)
QUICK = shapedb.RetryPolicy(initial_backoff=0.01, jitter=0)


def count(server, **options):
    with shapedb.Client(server.address, retry=QUICK, **options) as client:
        return client.collection().count()


def error_of(*answers, **options):
    with Fake(*answers) as server, pytest.raises(shapedb.ShapeDBError) as error:
        count(server, **options)
    return error.value, len(server.metadata)


def test_a_call_is_tried_again_until_it_succeeds():
    with Fake(UNAVAILABLE, FULL, UNAVAILABLE, COUNTED) as server:
        assert count(server) == 7
        assert len(server.metadata) == 4


def test_the_same_for_asyncio():
    async def main(address):
        async with shapedb.AsyncClient(address, retry=QUICK) as client:
            return await client.collection().count()

    with Fake(UNAVAILABLE, FULL, COUNTED) as server:
        assert asyncio.run(main(server.address)) == 7
        assert len(server.metadata) == 3


def test_an_upload_is_repeated_with_the_same_key_and_points():
    with Fake(UNAVAILABLE, FULL, pb.AddShapeResponse(outcome="OUTCOME_CREATED")) as server:
        with shapedb.Client(server.address, retry=QUICK) as client:
            client.collection().add("egg", solids.ball())
        assert len(server.uploads) == 3 and server.uploads[0] == server.uploads[1] == server.uploads[2]
        assert len(server.uploads[0]) == 2


def test_it_gives_up_after_as_many_tries_as_the_policy_says():
    error, tries = error_of(UNAVAILABLE)
    assert error.reason == "unavailable" and tries == 5


def test_what_is_not_idempotent_is_not_repeated():
    with Fake(UNAVAILABLE) as server, shapedb.Client(server.address, retry=QUICK) as client:
        with pytest.raises(shapedb.ShapeDBError):
            client.collection().delete("egg")
        assert len(server.metadata) == 1
        with pytest.raises(shapedb.ShapeDBError):
            client.collection().add("egg", solids.ball(), expected_version=3)
        assert len(server.uploads) == 1


@pytest.mark.parametrize("pushback", [-1, "soon"])
def test_a_server_may_forbid_retries(pushback):
    _, tries = error_of(fails(grpc.StatusCode.RESOURCE_EXHAUSTED, "queue_full", pushback=pushback))
    assert tries == 1


def test_the_wait_is_as_long_as_the_server_asks_for():
    start = time.monotonic()
    with Fake(fails(grpc.StatusCode.RESOURCE_EXHAUSTED, "rate_limited", pushback=400), COUNTED) as server:
        assert count(server) == 7
    assert time.monotonic() - start >= 0.4


def test_there_is_no_wait_beyond_the_deadline():
    start = time.monotonic()
    error, tries = error_of(fails(grpc.StatusCode.RESOURCE_EXHAUSTED, "queue_full", pushback=60_000), timeout=20)
    assert error.reason == "queue_full" and tries == 1 and time.monotonic() - start < 20


def test_exhausted_resources_without_a_hint_are_final():
    error, tries = error_of(fails(grpc.StatusCode.RESOURCE_EXHAUSTED, message="message too large"))
    assert error.reason == "internal" and tries == 1


def test_why_a_call_was_cut_off():
    error, _ = error_of(fails(grpc.StatusCode.DEADLINE_EXCEEDED, message="cut off by the server: too slow"))
    assert error.reason == "deadline_exceeded" and error.message == "cut off by the server: too slow"


@pytest.mark.parametrize("code, name, reason", [
    (grpc.StatusCode.NOT_FOUND, None, "not_found"),
    (grpc.StatusCode.INVALID_ARGUMENT, "malformed_filter", "malformed_filter"),
    (grpc.StatusCode.INTERNAL, "a_new_name", "a_new_name"),
    (grpc.StatusCode.UNKNOWN, None, "internal"),
    (grpc.StatusCode.DATA_LOSS, None, "data_loss"),
])
def test_errors_have_our_names(code, name, reason):
    error, _ = error_of(fails(code, name))
    assert error.reason == reason and error.message == "as told" and str(error) == f"as told [{reason}]"


def test_the_names_are_those_of_the_server():
    source = Path(__file__).resolve().parents[2] / "core/base/error.cpp"
    assert set(re.findall(r'return "([a-z_]+)";', source.read_text())) == set(shapedb.REASONS)


def hangs(context):
    done = threading.Event()
    context.add_callback(done.set)
    done.wait(20)
    return COUNTED


def test_a_deadline_passes():
    start = time.monotonic()
    error, tries = error_of(hangs, timeout=0.3)
    assert error.reason == "deadline_exceeded" and 0.3 <= time.monotonic() - start < 5 and tries == 1


def test_a_deadline_of_the_call_replaces_that_of_the_client():
    with Fake(COUNTED) as server, shapedb.Client(server.address, timeout=5) as client:
        collection = client.collection()
        collection.count()
        collection.count(timeout=1000)
        collection.count(timeout=math.inf)
        assert 0 < server.deadlines[0] <= 6 < 900 < server.deadlines[1] <= 1100  # as gRPC rounds
        assert server.deadlines[2] is None or server.deadlines[2] > 1e6
        with pytest.raises(shapedb.InvalidInput, match="timeout is -1"):
            collection.count(timeout=-1)


def test_nobody_there():
    with shapedb.Client("127.0.0.1:1", retry=QUICK, timeout=10) as client, pytest.raises(shapedb.ShapeDBError) as error:
        client.collection().count()
    assert error.value.reason == "unavailable" and "cannot reach a server at 127.0.0.1:1" in error.value.message


def test_closing_ends_the_calls_of_other_threads():
    with Fake(hangs) as server:
        client = shapedb.Client(server.address)
        errors = []

        def call():
            try:
                client.collection().count()
            except shapedb.ShapeDBError as error:
                errors.append(error.reason)

        threads = [threading.Thread(target=call) for _ in range(3)]
        for thread in threads:
            thread.start()
        while len(server.metadata) < 3:
            time.sleep(0.01)
        client.close()
        for thread in threads:
            thread.join(10)
        assert errors == ["cancelled"] * 3
        with pytest.raises(shapedb.ShapeDBError, match="cancelled"):
            client.collection().count()


def test_cancelling_a_task_ends_its_call():
    cancelled = threading.Event()

    def waits(context):
        context.add_callback(cancelled.set)
        cancelled.wait(20)
        return COUNTED

    async def main(server):
        async with shapedb.AsyncClient(server.address) as client:
            task = asyncio.create_task(client.collection().count())
            while not server.metadata:
                await asyncio.sleep(0.01)
            task.cancel()
            with pytest.raises(asyncio.CancelledError):
                await task

    with Fake(waits) as server:
        asyncio.run(main(server))
        assert cancelled.wait(5)


@pytest.mark.parametrize("call", ["count()", "add('egg', [(0, 0, n) for n in range(9)], wait=True)", "wait('egg')"])
def test_ctrl_c_ends_a_call_at_once(call):
    program = f"""
import sys, shapedb
client = shapedb.Client(sys.argv[1])
print("calling", flush=True)
try:
    client.collection().{call}
except KeyboardInterrupt:
    print("interrupted", flush=True)
    client.close()
"""
    cancelled = threading.Event()

    def waits(context):
        context.add_callback(cancelled.set)
        cancelled.wait(20)
        return COUNTED

    with Fake(waits) as server:
        process = subprocess.Popen([sys.executable, "-c", program, server.address], stdout=subprocess.PIPE, text=True)
        assert process.stdout.readline() == "calling\n"
        while not server.metadata:
            time.sleep(0.01)
        process.send_signal(signal.SIGINT)
        output, _ = process.communicate(timeout=10)
        assert output == "interrupted\n" and process.returncode == 0 and cancelled.wait(5)


@pytest.mark.parametrize("field, value", [("max_attempts", 0), ("multiplier", 0.5), ("jitter", 1.5),
                                          ("initial_backoff", -1), ("max_backoff", math.inf)])
def test_a_policy_has_ranges(field, value):
    with pytest.raises(shapedb.InvalidInput, match=f"retry.{field} is"):
        shapedb.RetryPolicy(**{field: value})


class _Error:
    def __init__(self, pushback=None):
        self._trailing = [] if pushback is None else [("grpc-retry-pushback-ms", pushback)]

    def code(self):
        return grpc.StatusCode.UNAVAILABLE

    def details(self):
        return ""

    def trailing_metadata(self):
        return self._trailing


def test_the_backoff_doubles_up_to_its_limit():
    policy = shapedb.RetryPolicy(max_attempts=20, jitter=0, max_backoff=1.0)
    delays = [policy.delay(attempt, Failure(_Error(), "")) for attempt in range(1, 8)]
    assert delays == [0.1, 0.2, 0.4, 0.8, 1.0, 1.0, 1.0]
    varied = [shapedb.RetryPolicy().delay(1, Failure(_Error(), "")) for _ in range(100)]
    assert 0.08 <= min(varied) < max(varied) <= 0.12
