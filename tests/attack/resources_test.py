# SPDX-License-Identifier: GPL-3.0-or-later
"""Attacks on memory, descriptors and threads."""

import queue
import socket
import threading
import time
import unittest

from attacker import (MIB, SecuredServer, Server, admin, align, ball, collections, eventually, grpc, limits_of,
                      main, pack, reason, run_together, search, shapes, types)
from rpcs import methods


class CompressedMessages(unittest.TestCase):
    def test_are_refused_without_being_inflated(self):
        with Server() as server, server.connect(compression=grpc.Compression.Gzip) as client:
            before = server.peak()
            for algorithm in (grpc.Compression.Gzip, grpc.Compression.Deflate):
                request = collections.CreateCollectionRequest(name="a", description="\0" * (256 * MIB))
                with self.assertRaises(grpc.RpcError) as failure:
                    client.collections.CreateCollection(request, timeout=60, compression=algorithm)
                self.assertIn(failure.exception.code(),
                              (grpc.StatusCode.UNIMPLEMENTED, grpc.StatusCode.RESOURCE_EXHAUSTED))
            self.assertLess(server.peak() - before, 32 * MIB)
            with server.connect() as plain:
                self.assertEqual(plain.count(), 0)

    def test_many_at_once_do_not_end_the_process(self):
        with Server(memory=3 * 1024 * MIB) as server:
            request = collections.CreateCollectionRequest(name="a", description="\0" * (64 * MIB))
            clients = [server.connect(compression=grpc.Compression.Gzip) for _ in range(4)]
            calls = [client.collections.CreateCollection.future(request, timeout=60) for client in clients * 2]
            for call in calls:
                self.assertIsNotNone(call.exception())
            self.assertTrue(server.running(), server.log())
            for client in clients:
                client.channel.close()


class Announcements(unittest.TestCase):
    def test_of_many_points_take_no_memory(self):
        with Server("--limits-max-points", "50000000", "--limits-max-upload-bytes", "1GiB",
                    "--metrics-listen", "127.0.0.1:0", memory=4096 * MIB) as server:
            with server.connect() as client:
                done = threading.Event()

                def announce(i):
                    yield shapes.AddShapeRequest(
                        header=shapes.AddShapeHeader(key=f"k{i}", point_count=50_000_000))
                    yield shapes.AddShapeRequest(chunk=types.PointChunk(xyz=b"\0" * 12))
                    done.wait(60)

                # 36 GB, if announcements were believed.
                calls = [client.shapes.AddShape.future(announce(i), timeout=120) for i in range(60)]
                self.assertTrue(eventually(lambda: server.begun() == 60))
                self.assertLess(server.resident(), 500 * MIB)
                self.assertEqual(client.count(), 0)
                done.set()
                for call in calls:
                    self.assertEqual(call.exception().code(), grpc.StatusCode.INVALID_ARGUMENT)
                self.assertTrue(server.running())


class Connections(unittest.TestCase):
    def open(self, server, count):
        opened = []
        for _ in range(count):
            opened.append(socket.create_connection(("127.0.0.1", server.port)))
        return opened

    def test_beyond_the_limit_of_open_files_do_not_deafen_the_server(self):
        with Server(open_files=80) as server:
            idle = self.open(server, 300)
            for connection in idle:
                connection.close()
            with server.connect() as client:
                self.assertTrue(eventually(lambda: answers(client)), server.log())
                self.assertTrue(client.serving())

    def test_beyond_their_number_are_closed_at_once(self):
        with Server("--limits-max-connections", "20") as server:
            idle = self.open(server, 60)
            closed = 0
            for connection in idle:
                connection.settimeout(30)
                try:
                    # The server of HTTP/2 speaks first: a connection that is served has its settings.
                    closed += connection.recv(1) == b""
                except ConnectionResetError:
                    closed += 1
            self.assertEqual(closed, 40)
            for connection in idle:
                connection.close()
            with server.connect() as client:
                self.assertTrue(eventually(lambda: answers(client)), server.log())
            self.assertIn("too many connections", server.log())

    def test_that_say_nothing_are_closed(self):
        with Server("--limits-max-connections", "5") as server:
            idle = self.open(server, 5)
            with server.connect() as client:
                self.assertTrue(eventually(lambda: answers(client), 40), "mute clients keep their places")
            for connection in idle:
                connection.close()


def answers(client):
    try:
        client.count(timeout=2)
        return True
    except grpc.RpcError:
        return False


class SlowUploads(unittest.TestCase):
    def drip(self, point_every, stop):
        yield shapes.AddShapeRequest(header=shapes.AddShapeHeader(key="slow", point_count=100_000))
        while not stop.wait(point_every):
            yield shapes.AddShapeRequest(chunk=types.PointChunk(xyz=b"\0" * 12))

    def test_leave_places_for_everything_else(self):
        with Server("--limits-max-uploads", "32") as server:
            stop = threading.Event()
            clients = [server.connect() for _ in range(6)]
            calls = [client.shapes.AddShape.future(self.drip(0.5, stop), timeout=60)
                     for client in clients for _ in range(25)]
            self.assertTrue(eventually(lambda: sum(call.done() for call in calls) >= 6 * 25 - 32, 30))
            refused = [call for call in calls if call.done()]
            self.assertEqual(len(refused), 6 * 25 - 32)
            for call in refused:
                self.assertEqual(call.exception().code(), grpc.StatusCode.RESOURCE_EXHAUSTED)
                self.assertIn("places for uploads", call.exception().details())
                self.assertEqual(reason(call.exception()), "queue_full")
            with server.connect() as other:
                self.assertEqual(other.count(timeout=5), 0)
                self.assertEqual(other.admin.Stats(admin.StatsRequest(), timeout=5).collections, 1)
            stop.set()
            for client in clients:
                client.channel.close()

    def test_are_cut_off(self):
        with Server("--limits-stall-seconds", "2", "--limits-min-bytes-per-second", "1000") as server:
            with server.connect() as client:
                stop = threading.Event()
                began = time.monotonic()
                with self.assertRaises(grpc.RpcError) as failure:
                    client.shapes.AddShape(self.drip(0.1, stop), timeout=60)
                stop.set()
                self.assertEqual(failure.exception.code(), grpc.StatusCode.DEADLINE_EXCEEDED)
                self.assertEqual(failure.exception.details(),
                                 "cut off by the server: the client sent or read less than 1000 bytes per second "
                                 "(limits.min_bytes_per_second)")
                self.assertLess(time.monotonic() - began, 15)
            self.assertTrue(eventually(lambda: "less than 1000 bytes per second" in server.log()), server.log())


# 4 MiB less a little: two bytes each for texts that take 32 and more when they are decoded.
MANY_EMPTY_TEXTS = b"\x12\x00" * ((4 * MIB - 1024) // 2)


def of_one_message():
    """The full names of the rpcs whose client sends one message."""
    return [f"/{service.full_name}/{method.name}" for service, method in methods() if not method.client_streaming]


def send(client, method, message, timeout=30):
    """The one message of a call, as it is; the error that comes of it."""
    try:
        list(client.channel.unary_stream(method)(message, timeout=timeout))
    except grpc.RpcError as error:
        return error
    return None


class Messages(unittest.TestCase):
    def test_that_are_none_are_refused(self):
        with SecuredServer() as server, server.local() as client:
            for method in of_one_message():
                error = send(client, method, b"\xff" * 100)
                self.assertEqual((error.code(), reason(error)),
                                 (grpc.StatusCode.INVALID_ARGUMENT, "invalid_argument"), method)
            self.assertEqual(client.count(), 0)

    def test_of_strangers_are_not_decoded(self):
        with SecuredServer() as server, server.connect() as stranger:
            for method in of_one_message():
                before = server.peak()
                error = send(stranger, method, MANY_EMPTY_TEXTS)
                self.assertEqual(error.code(), grpc.StatusCode.UNAUTHENTICATED, method)
                self.assertLess(server.peak() - before, 24 * MIB, method)

    def test_that_become_large_are_bounded(self):
        with Server() as server:
            clients = [server.connect() for _ in range(40)]
            refused = []

            def work(client):
                for _ in range(3):
                    error = send(client, "/shapedb.v1.ShapeService/GetShapes", MANY_EMPTY_TEXTS, timeout=120)
                    refused.append((error.code(), reason(error)))

            threads = [threading.Thread(target=work, args=(client,)) for client in clients]
            run_together(threads)
            for client in clients:
                client.channel.close()
            self.assertEqual(set(refused) - {(grpc.StatusCode.INVALID_ARGUMENT, "invalid_argument"),
                                             (grpc.StatusCode.RESOURCE_EXHAUSTED, "queue_full")}, set())
            # Those being decoded, and the messages themselves.
            self.assertLess(server.peak(), 1280 * MIB)
            self.assertTrue(server.running())


def upload_bombs():
    """Messages of uploads, of each kind of stream, that are made of two bytes for each of their many fields: fields
    that nobody knows, beside a header or in it, and entries of metadata."""
    def field(number, content):
        size, left = b"", len(content)
        while True:
            size += bytes([left & 127 | (128 if left > 127 else 0)])
            left >>= 7
            if not left:
                return bytes([number << 3 | 2]) + size + content
    many = (4 * MIB - 1024) // 2
    unknown = field(15, b"") * many
    for service, method in methods():
        if method.client_streaming:
            name = f"/{service.full_name}/{method.name}"
            yield name, unknown
            yield name, field(1, unknown)
            yield name, field(1, field(4, b"") * many)


class UploadMessages(unittest.TestCase):
    def test_that_become_large_are_bounded(self):
        with Server() as server:
            clients = [server.connect() for _ in range(12)]
            codes = set()

            def send_all(client, bombs):
                for method, message in bombs:
                    try:
                        list(client.channel.stream_stream(method)(iter([message]), timeout=300))
                    except grpc.RpcError as error:
                        codes.add((error.code(), reason(error)))

            bombs = list(upload_bombs())
            self.assertEqual(len(bombs), 7 * 3)
            # Three of each client at a time, of other kinds.
            threads = [threading.Thread(target=send_all, args=(client, bombs[first::3]))
                       for client in clients for first in range(3)]
            run_together(threads)
            for client in clients:
                client.channel.close()
            self.assertTrue(server.running())
            self.assertIn((grpc.StatusCode.RESOURCE_EXHAUSTED, "queue_full"), codes)
            # Those being decoded, and the messages themselves.
            self.assertLess(server.peak(), 1280 * MIB)

    def test_keep_nothing_that_the_api_does_not_have(self):
        """An upload lasts, and with it its header."""
        with Server("--metrics-listen", "127.0.0.1:0") as server:
            stop = threading.Event()
            chunk = types.PointChunk(xyz=pack(ball(100)))
            known = align.AlignRequest(header=align.AlignHeader(query_points=300, other_points=300))

            def stalled():
                body = known.header.SerializeToString() + b"\x7a\x00" * (MIB // 4)
                size = len(body)
                yield b"\x0a" + bytes([size & 127 | 128, size >> 7 & 127 | 128, size >> 14 & 127 | 128, size >> 21]) + body
                yield align.AlignRequest(chunk=chunk).SerializeToString()
                stop.wait(120)

            clients = [server.connect() for _ in range(4)]
            before = server.resident()
            calls = []
            for client in clients * 12:
                calls.append(client.channel.stream_unary("/shapedb.v1.AlignService/Align").future(stalled(), timeout=120))
                self.assertTrue(eventually(lambda: server.begun() == len(calls)))
            time.sleep(1)
            self.assertEqual([call.done() for call in calls], [False] * len(calls))
            # Some 25 MiB for each call, were the fields kept; what was freed may stay with the process.
            self.assertLess(server.resident() - before, 600 * MIB)
            stop.set()
            for client in clients:
                client.channel.close()


def copies_are_free(client):
    try:
        client.admin.ImportCollection(iter([admin.ImportCollectionRequest()]), timeout=10)
    except grpc.RpcError as error:
        return error.code() != grpc.StatusCode.RESOURCE_EXHAUSTED
    return True


def stalled_uploads(client, stop):
    """One call of each kind of upload: its beginning, then nothing until `stop`. By name."""
    def then_nothing(*messages):
        yield from messages
        stop.wait(60)

    some = types.PointChunk(xyz=b"\0" * 12)
    uploads = {
        "AddShape": (client.shapes.AddShape, [shapes.AddShapeRequest(header=shapes.AddShapeHeader(
            key="idle", point_count=100)), shapes.AddShapeRequest(chunk=some)]),
        "SearchByScan": (client.search.SearchByScan, [search.SearchByScanRequest(header=search.SearchByScanHeader(
            options=search.SearchOptions(k=1), point_count=100))]),
        "SearchByScanInStages": (client.search.SearchByScanInStages, [search.SearchByScanRequest(
            header=search.SearchByScanHeader(options=search.SearchOptions(k=1), point_count=100))]),
        "Align": (client.align.Align, [align.AlignRequest(header=align.AlignHeader(
            query_points=100, other_points=100)), align.AlignRequest(chunk=some)]),
        "Segment": (client.shapes.Segment, [shapes.SegmentRequest(header=shapes.SegmentHeader(point_count=100))]),
        "Restore": (client.admin.Restore, [admin.BackupChunk(total_bytes=4096, data=b"SQLite")]),
        "ImportCollection": (client.admin.ImportCollection, [admin.ImportCollectionRequest(
            header=admin.ImportCollectionHeader(collection="new"))]),
        "no header": (client.shapes.AddShape, []),
    }
    for name, (method, messages) in uploads.items():
        if name == "ImportCollection":
            # The status of the restore comes before its place is free.
            assert eventually(lambda: copies_are_free(client)), "the place for copies is still taken"
        if name in ("Segment", "SearchByScanInStages"):
            call = method(then_nothing(*messages), timeout=60)
            yield name, lambda call=call: list(call)
        else:
            yield name, method.future(then_nothing(*messages), timeout=60).result


# A client that takes no more of an answer than it has asked for.
NARROW = [("grpc.http2.bdp_probe", 0), ("grpc.http2.lookahead_bytes", 65_536)]


class CutOffCalls(unittest.TestCase):
    """A client that is cut off learns why, from the status alone."""

    def assert_cut_off(self, name, call, code, why):
        with self.assertRaises(grpc.RpcError, msg=name) as failure:
            call()
        self.assertEqual(failure.exception.code(), code, name)
        self.assertEqual(failure.exception.details(), "cut off by the server: " + why, name)

    def test_idle_uploads(self):
        with Server("--limits-stall-seconds", "1") as server, server.connect() as client:
            stop = threading.Event()
            # Restore and ImportCollection one after the other: only one of them may run.
            for name, call in stalled_uploads(client, stop):
                self.assert_cut_off(name, call, grpc.StatusCode.DEADLINE_EXCEEDED,
                                    "the client neither sent nor read anything for 1 seconds (limits.stall_seconds)")
            stop.set()
            self.assertEqual(client.count(), 0)

    def test_idle_downloads(self):
        with Server("--limits-stall-seconds", "1") as server, server.connect() as client:
            client.add("large", [(i % 1000, i // 1000, (i * i) % 999) for i in range(1_500_000)], timeout=120)
            points = client.shapes.GetPoints(shapes.GetPointsRequest(shape=shapes.ShapeRef(key="large")), timeout=60)
            self.assertEqual(next(points).shape.key, "large")
            self.assertTrue(eventually(lambda: "neither sent nor read" in server.log(), 30), server.log())
            self.assert_cut_off("GetPoints", lambda: list(points), grpc.StatusCode.DEADLINE_EXCEEDED,
                                "the client neither sent nor read anything for 1 seconds (limits.stall_seconds)")

    def test_unread_answers(self):
        """Of a call with one message. It is written at once: who does not read it has a thread until it is cut off."""
        with Server("--limits-stall-seconds", "1", "--metrics-listen", "127.0.0.1:0") as server, \
                server.connect(options=NARROW) as client:
            metadata = {f"note-{n}": "n" * 1000 for n in range(60)}
            for i in range(40):
                client.add(f"ball {i}", ball(100), metadata=metadata, wait=False)
            # As a stream, of which grpcio takes nothing before it is asked.
            unread = client.channel.unary_stream("/shapedb.v1.ShapeService/ListShapes",
                                                 request_serializer=shapes.ListShapesRequest.SerializeToString,
                                                 response_deserializer=shapes.ListShapesResponse.FromString)
            calls = [unread(shapes.ListShapesRequest(), timeout=60) for _ in range(5)]
            self.assertTrue(eventually(lambda: server.begun("ordinary") == len(calls)), "they keep their places")
            self.assertTrue(eventually(lambda: server.begun("ordinary") == 0, 30), "and give them back")
            self.assertIn("the answer of a call was not read", server.log())
            for call in calls:
                self.assert_cut_off("ListShapes", lambda call=call: list(call), grpc.StatusCode.DEADLINE_EXCEEDED,
                                    "the client neither sent nor read anything for 1 seconds (limits.stall_seconds)")

    def test_uploads_that_outlast_the_server(self):
        with Server("--shutdown-drain-seconds", "1", "--metrics-listen", "127.0.0.1:0") as server, server.connect() as client:
            stop = threading.Event()
            calls = [(name, call) for name, call in stalled_uploads(client, stop) if name != "ImportCollection"]
            self.assertTrue(eventually(lambda: (server.begun(), server.begun("admin")) == (len(calls) - 1, 1)))
            self.assertEqual(server.stop(), 0, server.log())
            for name, call in calls:
                self.assert_cut_off(name, call, grpc.StatusCode.UNAVAILABLE,
                                    "the server is shutting down: send it again after its restart")
            stop.set()


class Pace(unittest.TestCase):
    def test_is_refused_as_listed(self):
        """A call that is cut off has no `shapedb-error`: what is listed is its status."""
        def send(pause, stop):
            yield shapes.AddShapeRequest(header=shapes.AddShapeHeader(key="slow", point_count=100_000))
            while not stop.wait(pause):
                yield shapes.AddShapeRequest(chunk=types.PointChunk(xyz=b"\0" * 12))

        with Server("--limits-stall-seconds", "2", "--limits-min-bytes-per-second", "1000") as server, \
                server.connect() as client:
            limits = limits_of(client)
            for name, pause in (("limits.stall_seconds", 30), ("limits.min_bytes_per_second", 0.1)):
                stop = threading.Event()
                with self.assertRaises(grpc.RpcError) as failure:
                    client.shapes.AddShape(send(pause, stop), timeout=60)
                stop.set()
                self.assertIn(name, failure.exception.details())
                self.assertEqual(failure.exception.code().name.lower(), limits[name].refusal)


class Floods(unittest.TestCase):
    def test_of_calls_are_refused_by_name_and_pass(self):
        with Server() as server, server.connect() as busy:
            busy.add("ball", ball())
            watch = shapes.WatchIngestRequest(shape=shapes.ShapeRef(key="ball"))
            failures = queue.Queue()

            def flood():
                with server.connect() as client:
                    calls = [client.shapes.CountShapes.future(shapes.CountShapesRequest(), timeout=60)
                             for _ in range(300)]
                    for call in calls:
                        if call.exception() is not None:
                            failures.put(call.exception())

            threads = [threading.Thread(target=flood) for _ in range(8)]
            run_together(threads)
            while not failures.empty():
                failure = failures.get()
                self.assertEqual(failure.code(), grpc.StatusCode.RESOURCE_EXHAUSTED, failure)
            self.assertEqual(busy.count(), 1)
            self.assertTrue(list(busy.shapes.WatchIngest(watch, timeout=10)))


if __name__ == "__main__":
    main()
