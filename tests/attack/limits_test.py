# SPDX-License-Identifier: GPL-3.0-or-later
"""Each limit of ServerInfo: what is under it and at it is taken, what is over it is refused by name.

A limit without a case here, or without a test of another file that is named here, fails."""

import contextlib
import os
import socket
import sqlite3
import tempfile
import threading
import time
import unittest

import health_pb2
from shapedb.v1 import shape_service_pb2_grpc as shapes_grpc

from attacker import (CHUNK_POINTS, MIB, SecuredServer, Server, admin, ball, collections, eventually, grpc,
                      limits_of, main, reason, search, shapes, types)

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..")
WAITING_POINTS = 85_000  # so many that their segmentation takes longer than what is tried beside it

# Those that need many clients or much time: the file and the test that try them.
ELSEWHERE = {
    "calls": ("tests/server/catalog/gates_test.cpp", "NoKindOfCallShutsTheOthersOut"),
    "admin_calls": ("tests/server/catalog/gates_test.cpp", "NoKindOfCallShutsTheOthersOut"),
    "long_admin_calls": ("tests/server/catalog/gates_test.cpp", "WhatLastsLeavesPlacesForAdministrators"),
    "followers": ("tests/server/catalog/call_frame_test.cpp", "FollowersGiveTheirPlacesBack"),
    "requests_bytes": ("tests/attack/resources_test.py", "test_that_become_large_are_bounded"),
    "answers_bytes": ("tests/server/catalog/searches_test.cpp", "IsSharedByAllAnswersUntilTheyAreGone"),
    "transport_bytes": ("tests/attack/resources_test.py", "test_many_at_once_do_not_end_the_process"),
    "handshake_milliseconds": ("tests/attack/resources_test.py", "test_that_say_nothing_are_closed"),
    "limits.stall_seconds": ("tests/integration/lifecycle_test.cpp", "StalledUploadIsCutOff"),
    "limits.min_bytes_per_second": ("tests/attack/resources_test.py", "test_are_cut_off"),
    "ingest.max_attempts": ("tests/server/ingest/worker_pool_test.cpp", "JobOfADeadProcessIsDoneAgainButNotForEver"),
}


class Limits(unittest.TestCase):
    FLAGS = ("--limits-max-points", "100000", "--limits-max-k", "200", "--limits-max-batch", "20",
             "--limits-max-uploads", "3", "--limits-max-upload-bytes", str(2 * MIB), "--limits-max-connections", "30",
             "--ingest-max-queued-bytes", str(2 * MIB), "--ingest-max-queued-jobs", "1000", "--ingest-threads", "1")

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory(prefix="shapedb-limits-")
        cls.addClassCleanup(cls.folder.cleanup)
        cls.server = SecuredServer(*cls.FLAGS, directory=cls.folder.name + "/data")
        cls.addClassCleanup(cls.server.__exit__)
        cls.client = cls.server.local()
        cls.addClassCleanup(cls.client.__exit__)
        cls.client.add("ball", ball(300), metadata={"group": "g"})
        cls.limits = limits_of(cls.client)

    def test_every_limit_has_a_case(self):
        own = {name[len("case_"):] for name in dir(self) if name.startswith("case_")}
        own |= {name[len("test_"):] for name in dir(Stored) if name.startswith("test_")}
        listed = {name.replace(".", "_") for name in self.limits}
        elsewhere = {name.replace(".", "_") for name in ELSEWHERE}
        self.assertEqual(own | elsewhere, listed)
        for path, test in ELSEWHERE.values():
            with open(os.path.join(ROOT, path)) as file:
                self.assertIn(test, file.read(), path)

    def test_under_at_and_over_each_of_them(self):
        for name, limit in self.limits.items():
            case = getattr(self, "case_" + name.replace(".", "_"), None)
            if case is not None:
                with self.subTest(limit=name, value=limit.value):
                    case(limit)

    def test_are_documented_with_their_defaults(self):
        with Server() as server, server.connect() as client:
            listed = [[limit.name, f"{limit.value:,}", limit.unit, limit.bounds, limit.refusal]
                      for limit in client.admin.ServerInfo(admin.ServerInfoRequest(), timeout=10).limit_table]
        with open(os.path.join(ROOT, "docs/limits.md")) as file:
            documented = [[cell.strip().strip("`") for cell in line.strip().strip("|").split("|")]
                          for line in file if line.startswith("| `")]
        self.assertEqual(documented, listed)

    # Helpers --------------------------------------------------------------------------------

    def three(self, limit, call, *words, allowed=()):
        """`call(n)` one under, at and one over; a refusal for another reason (`allowed`) is no refusal."""
        for n in (limit.value - 1, limit.value):
            try:
                call(n)
            except grpc.RpcError as error:
                self.assertIn(reason(error), allowed, f"{n}: {error.details()}")
        self.refused(limit, lambda: call(limit.value + 1), *words)

    def refused(self, limit, call, *words):
        with self.assertRaises(grpc.RpcError) as failure:
            call()
        error = failure.exception
        self.assertEqual(reason(error), limit.refusal, error.details())
        for word in (str(limit.value), *words):
            self.assertIn(word, error.details())

    def ref(self, key="ball"):
        return shapes.ShapeRef(key=key)

    def find(self, **options):
        options = search.SearchOptions(**{"k": 1, "verify": False, **options})
        return self.client.search.SearchByKey(search.SearchByKeyRequest(options=options, key="ball"), timeout=30)

    def change(self, metadata):
        return self.client.shapes.UpdateMetadata(shapes.UpdateMetadataRequest(
            key="ball", change=shapes.MetadataChange(replace_all=True, set=metadata)), timeout=30)

    @contextlib.contextmanager
    def open_uploads(self, client, count, points=0):
        """Uploads that have sent their header and so many points, and wait."""
        release = threading.Event()

        def send(key):
            yield shapes.AddShapeRequest(header=shapes.AddShapeHeader(key=key, point_count=100_000))
            if points:
                yield shapes.AddShapeRequest(chunk=types.PointChunk(xyz=b"\0" * (12 * points)))
            release.wait(60)

        calls = [client.shapes.AddShape.future(send(f"open {i}"), timeout=60) for i in range(count)]
        try:
            yield calls
        finally:
            release.set()
            for call in calls:
                call.exception()

    # Names and text -------------------------------------------------------------------------

    def case_collection_name_bytes(self, limit):
        create = lambda n: self.client.collections.CreateCollection(
            collections.CreateCollectionRequest(name="c" * n), timeout=10)
        self.three(limit, create, "name")

    def case_description_bytes(self, limit):
        create = lambda n: self.client.collections.CreateCollection(
            collections.CreateCollectionRequest(name=f"d{n}", description="d" * n), timeout=10)
        self.three(limit, create, "description")

    def case_key_bytes(self, limit):
        get = lambda n: self.client.shapes.GetShape(shapes.GetShapeRequest(shape=self.ref("k" * n)), timeout=10)
        self.three(limit, get, "key", allowed=["not_found"])
        self.three(limit, lambda n: self.client.add("k" * n, ball(100), wait=False), "key")

    def case_key_prefix_bytes(self, limit):
        count = lambda n: self.client.shapes.CountShapes(shapes.CountShapesRequest(key_prefix="k" * n), timeout=10)
        self.three(limit, count, "key_prefix")

    def case_metadata_entries(self, limit):
        self.three(limit, lambda n: self.change({f"k{i}": "v" for i in range(n)}), "metadata", "entries")

    def case_metadata_removed_keys(self, limit):
        remove = lambda n: self.client.shapes.UpdateMetadata(shapes.UpdateMetadataRequest(
            key="ball", change=shapes.MetadataChange(remove=[f"none{i}" for i in range(n)])), timeout=30)
        self.three(limit, remove, "remove")

    def case_metadata_key_bytes(self, limit):
        self.three(limit, lambda n: self.change({"k" * n: "v"}), "metadata: key")

    def case_metadata_value_bytes(self, limit):
        self.three(limit, lambda n: self.change({"k": "v" * n}), "metadata: the value")

    def case_filter_bytes(self, limit):
        count = lambda n: self.client.shapes.CountShapes(
            shapes.CountShapesRequest(filter="k=" + "v" * (n - 2)), timeout=10)
        self.three(limit, count, "filter")

    def case_api_key_name_bytes(self, limit):
        make = lambda n: self.client.admin.CreateKey(
            admin.CreateKeyRequest(name="n" * n, role=admin.ROLE_READER), timeout=10)
        self.three(limit, make, "name of a key")

    def case_api_key_collections(self, limit):
        make = lambda n: self.client.admin.CreateKey(admin.CreateKeyRequest(
            name="many", role=admin.ROLE_READER, collections=[f"c{i}" for i in range(n)]), timeout=10)
        self.three(limit, make, "collections")

    # Scans and messages ---------------------------------------------------------------------

    def case_min_points(self, limit):
        for n in (limit.value + 1, limit.value):
            self.client.add(f"few {n}", ball(n), wait=False)
        self.refused(limit, lambda: self.client.add("fewer", ball(limit.value - 1), wait=False), "point_count")

    def case_limits_max_points(self, limit):
        announce = lambda n: self.client.shapes.AddShape(
            iter([shapes.AddShapeRequest(header=shapes.AddShapeHeader(key="big", point_count=n))]), timeout=30)
        self.three(limit, announce, "point_count", limit.name, allowed=["count_mismatch"])

    def case_chunk_bytes(self, limit):
        restore = lambda n: self.client.admin.Restore(
            iter([admin.BackupChunk(total_bytes=n + 100, data=b"x" * n)]), timeout=30)
        self.three(limit, restore, "chunk", allowed=["count_mismatch"])

        def add(n):
            self.client.shapes.AddShape(iter([
                shapes.AddShapeRequest(header=shapes.AddShapeHeader(key="big", point_count=100_000)),
                shapes.AddShapeRequest(chunk=types.PointChunk(xyz=b"\0" * n))]), timeout=30)
        whole = limit.value // 12 * 12
        with self.assertRaises(grpc.RpcError) as failure:
            add(whole)
        self.assertEqual(reason(failure.exception), "count_mismatch")
        self.refused(limit, lambda: add(whole + 12), "chunk")

    def case_message_bytes(self, limit):
        # A field of n bytes has a tag and a length in front of it.
        get = lambda n: self.client.shapes.GetShape(
            shapes.GetShapeRequest(shape=self.ref("k" * (n - 10))), timeout=30)
        for n in (limit.value - 1, limit.value):
            with self.assertRaises(grpc.RpcError) as failure:
                get(n)
            self.assertEqual(reason(failure.exception), "invalid_argument")
        with self.assertRaises(grpc.RpcError) as failure:
            get(limit.value + 1)
        self.assertEqual(failure.exception.code(), grpc.StatusCode.RESOURCE_EXHAUSTED)
        self.assertIn(str(limit.value), failure.exception.details())

    def case_error_message_bytes(self, limit):
        def told(n):
            with self.assertRaises(grpc.RpcError) as failure:
                self.client.shapes.GetShapes(shapes.GetShapesRequest(collection="c" * n, keys=["k"]), timeout=10)
            return failure.exception.details()
        beside = len(told(1)) - 1
        for n in (limit.value - 1, limit.value):
            self.assertEqual(len(told(n - beside)), n)
        self.assertEqual(len(told(limit.value + 1 - beside)), limit.value, "cut")

    # Searches -------------------------------------------------------------------------------

    def case_limits_max_k(self, limit):
        self.three(limit, lambda n: self.find(k=n), "k:", limit.name)

    def case_limits_max_batch(self, limit):
        def batch(n):
            query = search.SearchBatchRequest.Query(key="ball")
            self.client.search.SearchBatch(search.SearchBatchRequest(
                options=search.SearchOptions(k=1, verify=False), queries=[query] * n), timeout=60)
        self.three(limit, batch, "queries", limit.name)

    def case_per_group(self, limit):
        self.three(limit, lambda n: self.find(group_by="group", per_group=n), "per_group")

    def case_verify_candidates(self, limit):
        self.three(limit, lambda n: self.find(verify_candidates=n), "verify_candidates")

    # Listings -------------------------------------------------------------------------------

    def case_keys(self, limit):
        get = lambda n: self.client.shapes.GetShapes(
            shapes.GetShapesRequest(keys=[f"k{i}" for i in range(n)]), timeout=30)
        self.three(limit, get, "keys")

    def case_page_size(self, limit):
        self.three(limit, lambda n: self.client.shapes.ListShapes(
            shapes.ListShapesRequest(page_size=n), timeout=30), "page_size")

    def case_max_values(self, limit):
        self.three(limit, lambda n: self.client.shapes.CountByValue(
            shapes.CountByValueRequest(metadata_key="group", max_values=n), timeout=30), "max_values")

    # Calls and connections ------------------------------------------------------------------

    def case_limits_max_uploads(self, limit):
        with self.open_uploads(self.client, limit.value - 1):
            self.client.add("last place", ball(100), wait=False)
        with self.open_uploads(self.client, limit.value):
            def one_more():
                self.client.add("no place", ball(100), wait=False)
            self.assertTrue(eventually(lambda: self.code(one_more) == limit.refusal, 20))
            self.refused(limit, one_more, "uploads", limit.name)
        self.client.add("a place again", ball(100), wait=False)

    def code(self, call):
        try:
            call()
            return None
        except grpc.RpcError as error:
            return reason(error)

    def case_limits_max_upload_bytes(self, limit):
        half = CHUNK_POINTS  # 0.96 MB, of 2 MiB
        self.assertLess(2 * 12 * half, limit.value)
        with self.open_uploads(self.client, 2, half) as calls:
            one_more = lambda: self.client.add("no room", ball(half), wait=False)
            self.assertTrue(eventually(lambda: self.code(one_more) == limit.refusal, 30))
            self.refused(limit, one_more, limit.name)
            self.assertTrue(all(call.running() for call in calls), "what was there first stays")

    def case_limits_max_connections(self, limit):
        self.connections(limit, lambda: socket.create_connection(("127.0.0.1", self.server.port)))

    def case_local_connections(self, limit):
        def connect():
            connection = socket.socket(socket.AF_UNIX)
            connection.connect(self.server.data + ".sock")
            return connection
        self.connections(limit, connect, own=1)

    def connections(self, limit, connect, own=0):
        with contextlib.ExitStack() as opened:
            held = [opened.enter_context(connect()) for _ in range(limit.value - own)]
            extra = opened.enter_context(connect())
            extra.settimeout(10)
            # One that is taken hears the server's settings; one too many hears of its end alone.
            with contextlib.suppress(ConnectionResetError):
                self.assertEqual(extra.recv(100), b"")
            for connection in held:
                connection.settimeout(10)
                self.assertNotEqual(connection.recv(100), b"")
        self.assertTrue(eventually(lambda: self.taken(connect), 20), "places are free again")

    def taken(self, connect):
        with connect() as connection, contextlib.suppress(ConnectionResetError):
            connection.settimeout(5)
            return connection.recv(100) != b""
        return False

    def case_streams_of_connection(self, limit):
        """Health watches have no other limit. What is over it waits in the client."""
        watch = lambda: self.client.health.Watch(health_pb2.HealthCheckRequest(), timeout=60)
        with contextlib.ExitStack() as opened:
            watches = []
            for _ in range(limit.value):
                watches.append(watch())
                opened.callback(watches[-1].cancel)
                next(watches[-1])
            heard = threading.Event()

            def one_more():
                late = watch()
                next(late)
                heard.set()
                late.cancel()
            thread = threading.Thread(target=one_more)
            thread.start()
            self.assertFalse(heard.wait(1))
            watches[0].cancel()
            self.assertTrue(heard.wait(20))
            thread.join()

    def case_limits_idle_seconds(self, limit):
        with Server("--limits-idle-seconds", "3") as server:
            with socket.create_connection(("127.0.0.1", server.port)) as connection:
                began = time.monotonic()
                connection.sendall(b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n" + b"\0\0\0\4\0\0\0\0\0")  # no settings
                connection.settimeout(30)
                while connection.recv(1_000):
                    pass
                self.assertGreater(time.monotonic() - began, 2)
                self.assertLess(time.monotonic() - began, 20)

    # The queue ------------------------------------------------------------------------------

    def case_ingest_max_queued_bytes(self, limit):
        self.assertLess(2 * 12 * WAITING_POINTS, limit.value)
        self.fill(self.client, limit, "bytes")

    def case_ingest_max_queued_jobs(self, limit):
        with Server("--ingest-max-queued-jobs", "5", "--ingest-threads", "1") as server, server.connect() as client:
            self.fill(client, limits_of(client)[limit.name], "scans")

    def fill(self, client, limit, unit):
        points = [ball(WAITING_POINTS, 1 + i) for i in range(3)]
        for i in range(40):
            try:
                client.add(f"waiting {i}", points[i % 3], wait=False)
            except grpc.RpcError as error:
                self.assertGreaterEqual(i, 5 if unit == "scans" else 2, "what is under and at it is taken")
                self.assertEqual(reason(error), limit.refusal)
                for word in (str(limit.value), unit, limit.name):
                    self.assertIn(word, error.details())
                break
        else:
            self.fail("the queue is never full")
        stats = client.admin.Stats(admin.StatsRequest(), timeout=10)
        held = stats.queued_bytes if unit == "bytes" else stats.queued_jobs + stats.running_jobs
        self.assertLessEqual(held, limit.value)


class Stored(unittest.TestCase):
    """Limits that take many shapes, which are written into the database: failed ones, that nobody segments."""

    FAT = 1_000  # shapes with as much metadata as there may be

    @classmethod
    def setUpClass(cls):
        cls.server = Server()
        cls.addClassCleanup(cls.server.__exit__)
        assert cls.server.stop() == 0
        with contextlib.closing(sqlite3.connect(cls.server.data + "/shapedb.sqlite")) as database:
            cls.fill(database)
            database.commit()
        cls.server.start()
        cls.client = cls.server.connect()
        cls.addClassCleanup(cls.client.__exit__)
        cls.big = grpc.insecure_channel(cls.server.address, options=[("grpc.max_receive_message_length", -1)])
        cls.addClassCleanup(cls.big.close)
        cls.limits = limits_of(cls.client)

    @classmethod
    def fill(cls, database):
        entries, value = 64, "v" * 1_024
        different = 100_000
        parameters, = database.execute("SELECT parameters FROM collection").fetchone()
        for name in ("fat", "different"):
            database.execute("INSERT INTO collection (name, description, parameters, generation, created_at) "
                             "VALUES (?, '', ?, 1, 0)", (name, parameters))
        ids = dict(database.execute("SELECT name, id FROM collection"))

        def add(collection, count, metadata):
            first, = database.execute("SELECT coalesce(max(id), 0) + 1 FROM shape").fetchone()
            database.executemany(
                "INSERT INTO shape (id, collection_id, key, version, points_version, state, point_count, checksum, "
                "created_at, updated_at, failure_code, failure_message) "
                "VALUES (?, ?, ?, 1, 1, 2, 4, zeroblob(32), 0, 0, 'internal', 'made up')",
                ((first + i, ids[collection], f"k{i}") for i in range(count)))
            database.executemany("INSERT INTO shape_metadata VALUES (?, ?, ?)",
                                 ((first + i, name, text) for i in range(count) for name, text in metadata(i)))

        add("fat", cls.FAT, lambda i: [(f"m{j:02}" + "x" * 120, value) for j in range(entries)])
        add("different", different + 1, lambda i: [(name, f"v{i}") for name, most in
                                                   (("under", different - 1), ("at", different),
                                                    ("over", different + 1)) if i < most])

    def get(self, count):
        return shapes_grpc.ShapeServiceStub(self.big).GetShapes(shapes.GetShapesRequest(
            collection="fat", keys=[f"k{i % self.FAT}" for i in range(count)]), timeout=60)

    def test_answer_bytes(self):
        limit = self.limits["answer_bytes"]
        size = self.get(100).ByteSize() / 100
        most = int(limit.value // size)
        self.assertLess(most, 999, "enough shapes for the test")
        for n in (most - 2, most - 1):
            self.assertLessEqual(self.get(n).ByteSize(), limit.value)
        with self.assertRaises(grpc.RpcError) as failure:
            self.get(most + 2)
        self.assertEqual(reason(failure.exception), limit.refusal)
        self.assertIn(str(limit.value), failure.exception.details())

    def test_page_bytes(self):
        limit = self.limits["page_bytes"]
        seen, cursor = 0, ""
        while True:
            page = self.client.shapes.ListShapes(
                shapes.ListShapesRequest(collection="fat", page_size=1_000, cursor=cursor), timeout=60)
            self.assertLessEqual(page.ByteSize(), limit.value + 80_000, "at most one shape more")
            seen, cursor = seen + len(page.shapes), page.next_cursor
            if not cursor:
                break
            self.assertGreaterEqual(page.ByteSize(), limit.value, "not before")
        self.assertEqual(seen, self.FAT)

    def test_different_values(self):
        limit = self.limits["different_values"]
        count = lambda key: self.client.shapes.CountByValue(shapes.CountByValueRequest(
            collection="different", metadata_key=key, max_values=1), timeout=60)
        self.assertEqual(count("under").other_values, limit.value - 2)
        self.assertEqual(count("at").other_values, limit.value - 1)
        with self.assertRaises(grpc.RpcError) as failure:
            count("over")
        self.assertEqual(reason(failure.exception), limit.refusal)
        for word in ("metadata_key", "different values", str(limit.value)):
            self.assertIn(word, failure.exception.details())

    def test_copies(self):
        limit = self.limits["copies"]
        self.assertEqual(limit.value, 1)
        unread = self.client.admin.Backup(admin.BackupRequest(), timeout=60)
        next(unread)
        with self.server.connect() as other:
            with self.assertRaises(grpc.RpcError) as failure:
                next(other.admin.Backup(admin.BackupRequest(), timeout=60))
            self.assertEqual(reason(failure.exception), limit.refusal)
            for word in ("1 places", "backup"):
                self.assertIn(word, failure.exception.details())
            unread.cancel()

            def again():
                try:
                    return bool(next(other.admin.Backup(admin.BackupRequest(), timeout=60)))
                except grpc.RpcError:
                    return False
            self.assertTrue(eventually(again, 30), "the place is free again")


if __name__ == "__main__":
    main()
