# SPDX-License-Identifier: GPL-3.0-or-later
"""What a hostile client may try over HTTP, with sockets of its own."""

import gzip
import re
import socket
import threading
import time
import unittest

from attacker import MIB, ball, collections, eventually, main, run_together, shapes, types
from connect import COUNT, JSON, Http, Raw, answers, count_request, envelope, head, serve


class Requests(unittest.TestCase):
    """That are no good, or too much."""

    def test_that_are_malformed_are_refused_by_name(self):
        with serve() as server, Http(server) as client:
            for text in ("", "{", "[]", "nonsense", '{"collectoin": "a"}', '{"collection": 5}', "\xff", "{" * 100_000):
                answer = client.request("POST", COUNT, text.encode("latin-1"), content_type="application/json")
                self.assertEqual((answer.status, answer.json()["code"]), (400, "invalid_argument"), text[:20])
            packed = gzip.compress(b"\0" * (64 * MIB))
            bomb = client.request("POST", COUNT, packed, content_type="application/json", content_encoding="gzip")
            self.assertEqual((bomb.status, bomb.json()["code"]), (501, "unimplemented"))
            client.connection.close()
            watch = "/shapedb.v1.ShapeService/WatchIngest"
            for body in (b"", b"\0", b"\0\0\0\0\x05{}", envelope(b"{}") * 2, envelope(packed, 1), envelope(b"{}", 2),
                         envelope(b"{}", 0xff)):
                answer = client.request("POST", watch, body, content_type="application/connect+json")
                self.assertIn(answer.error()["code"], ("invalid_argument", "unimplemented"), body[:20])
                client.connection.close()

    def test_that_nest_deep_take_no_memory(self):
        with serve() as server, Http(server) as client:
            client.json("ShapeService/CountShapes")
            before = server.peak()
            deep = b"[" * (2 * MIB)
            for text in (b'{"filter":' + deep, deep, b'{"x":' * (MIB // 4), b"{'\"': " + deep, b"{'\\'\"': " + deep,
                         b'{"\\"\'": ' + deep):
                answer = client.request("POST", COUNT, text, content_type="application/json")
                self.assertEqual((answer.status, answer.json()["code"]), (400, "invalid_argument"), text[:20])
                self.assertIn("nests more than 32 deep", answer.json()["message"], text[:20])
            self.assertLess(server.peak() - before, 40 * MIB)
            flat = b'{"filter": "' + b"[" * 100 + b'"}'
            answer = client.request("POST", COUNT, flat, content_type="application/json")
            self.assertNotIn(b"nests", answer.body, "in a text it is no list")

    def test_that_two_could_read_in_two_ways_are_refused(self):
        """Request smuggling."""
        hidden = head("/healthz", method="GET")
        with serve() as server:
            for fields in (["Content-Length: 2", "Transfer-Encoding: chunked"],
                           ["Transfer-Encoding: chunked", "Content-Length: 2"], ["Content-Length: 2", "Content-Length: 3"],
                           ["Transfer-Encoding: xchunked"], ["Transfer-Encoding: gzip, chunked"],
                           ["Transfer-Encoding: chunked", "Transfer-Encoding: identity"],
                           ["Content-Length : 2"], ["Content-Length: +2"], ["Content-Length: 0x2"], ["Content-Length: 2,2"],
                           ["Content-Length: -1"], ["Content-Length: 99999999999999999999999"]):
                with Raw(server) as raw:
                    raw.socket.settimeout(5)
                    try:
                        text = raw.send(head(COUNT, JSON, *fields) + "{}" + hidden).rest()
                    except socket.timeout:
                        self.fail(fields)
                    self.assertTrue(re.match(rb"HTTP/1.1 (400|501) ", text), (fields, text))
                    self.assertEqual(text.count(b"HTTP/1.1 "), 1, (fields, text))
            for chunks in ("2;\n\r\n{}\r\n0\r\n\r\n", "2\n{}\r\n0\r\n\r\n", "2\r\n{}0\r\n\r\n", "-2\r\n{}\r\n0\r\n\r\n",
                           "ffffffffffffffffff\r\n{}", "x\r\n"):
                with Raw(server) as raw:
                    text = raw.send(head(COUNT, JSON, "Transfer-Encoding: chunked") + chunks + hidden).rest()
                    self.assertNotIn(b"SERVING", text, chunks)
            for first in ("GET / HTTP/1.1\nHost: localhost\n\n", "GET  / HTTP/1.1\r\nHost: localhost\r\n\r\n",
                          "GET / HTTP/2.0\r\nHost: localhost\r\n\r\n", "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n",
                          "GET / HTTP/1.1\r\n\r\n", "GET / HTTP/1.1\r\nHost: a\r\nHost: b\r\n\r\n",
                          "\x16\x03\x01\x02\0\x01\0\x01\xfc", "GET http://localhost/ HTTP/1.1\r\nHost: localhost\r\n\r\n",
                          "GET / HTTP/1.1\r\nHost: localhost\r\nA: b\0c\r\n\r\n"):
                with Raw(server, timeout=20) as raw:
                    text = raw.send(first).rest()
                    self.assertTrue(re.match(rb"HTTP/1.1 (400|408|421|505) ", text), (first, text))
            self.assertTrue(answers(server))

    def test_that_are_too_large_are_cut_short(self):
        with serve() as server:
            before = server.peak()
            with Raw(server) as raw:
                self.assertEqual(raw.send(head(COUNT, JSON, "X: " + "a" * 20_000)).status(), 431)
            with Raw(server) as raw:
                self.assertEqual(raw.send("GET /" + "a" * 20_000).status(), 431)
            with Raw(server) as raw:
                self.assertEqual(raw.send(head("/", *[f"X{i}: {i}" for i in range(5_000)], method="GET")).status(), 431)
            for field in ("Content-Length: 100000000", "Transfer-Encoding: chunked"):
                with Raw(server) as raw:
                    raw.send(head(COUNT, JSON, field))
                    block = b"a" * MIB
                    if "chunked" in field:
                        block = b"100000\r\n" + block + b"\r\n"
                    try:
                        for _ in range(50):
                            raw.send(block)
                    except OSError:
                        pass  # it has stopped to listen
                    self.assertIn(b" 429 ", raw.rest()[:20])
            with Raw(server) as raw:
                raw.send(head("/shapedb.v1.ShapeService/WatchIngest", "Content-Type: application/connect+proto",
                              "Content-Length: 100000000").encode() + b"\0\xff\xff\xff\xff")
                self.assertIn(b'"resource_exhausted"', raw.rest())
            with Raw(server) as raw:  # a head of a chunk without end
                raw.send(head(COUNT, JSON, "Transfer-Encoding: chunked"))
                try:
                    for _ in range(100):
                        raw.send("1;" + "a" * 10_000)
                except OSError:
                    pass
                self.assertNotIn(b" 200 ", raw.rest()[:20])
            self.assertLess(server.peak() - before, 64 * MIB)
            self.assertTrue(answers(server))

    def test_a_large_one_is_taken_and_a_larger_one_refused_as_by_grpc(self):
        with serve() as server, Http(server) as client:
            def ask(size):
                message = collections.CreateCollectionRequest(name="a", description="x" * size)
                return client.request("POST", "/shapedb.v1.CollectionService/CreateCollection",
                                      message.SerializeToString(), content_type="application/proto")
            self.assertEqual(ask(4 * MIB - 100).json()["details"][0]["debug"], {"name": "invalid_argument"})
            self.assertEqual(ask(4 * MIB).json()["code"], "resource_exhausted")

    def test_random_bytes_do_no_harm(self):
        seed = b"POST / HTTP/1.1\r\nHost: localhost\r\nTransfer-Encoding: chunked\r\n\r\n5\r\nhello\r\n0\r\n\r\n"
        with serve() as server:
            for i in range(200):
                data = bytearray(seed * 3)
                for at in range(i % 40):
                    data[(i * 7919 + at * 104_729) % len(data)] = (i * 31 + at * 17) % 256
                with Raw(server) as raw:
                    raw.send(bytes(data))
                    raw.socket.shutdown(socket.SHUT_WR)
                    raw.rest()
            self.assertTrue(server.running())
            self.assertTrue(answers(server))


class SlowClients(unittest.TestCase):
    def test_have_ten_seconds_for_a_head(self):
        with serve() as server:
            mute, slow = Raw(server), Raw(server)
            slow.send("POST / HTTP/1.1\r\nHo")
            began = time.monotonic()
            self.assertEqual(slow.status(), 408)
            self.assertEqual(mute.rest(), b"")
            self.assertLess(time.monotonic() - began, 20)
            for raw in (mute, slow):
                raw.socket.close()

    def drip(self, raw, data, pause):
        """One byte at a time, until the server has had enough."""
        began = time.monotonic()
        raw.socket.settimeout(0.01)
        answer = b""
        for i in range(600):
            try:
                raw.send(data[i % len(data):][:1])
            except OSError:
                break
            try:
                piece = raw.socket.recv(65_536)
                answer += piece
                if not piece:
                    break
            except socket.timeout:
                pass
            except OSError:
                break
            time.sleep(pause)
        return answer, time.monotonic() - began

    def assert_told(self, text, words):
        """The failure is that of gRPC: code, name and message."""
        self.assertIn(b'"code":"deadline_exceeded"', text)
        self.assertIn(b'"debug":{"name":"deadline_exceeded"}', text)
        self.assertRegex(text, b'"message":"cut off by the server: [^"]*' + words)

    def test_of_unary_calls_are_cut_off(self):
        with serve("--limits-stall-seconds", "2", "--limits-min-bytes-per-second", "1000") as server:
            with Raw(server) as raw:
                raw.send(head(COUNT, JSON, "Content-Length: 1000"))
                began = time.monotonic()
                text = raw.rest()
                self.assert_told(text, b"neither sent nor read anything for 2 seconds")
                self.assertLess(time.monotonic() - began, 10)
            with Raw(server) as raw:
                raw.send(head(COUNT, JSON, "Content-Length: 100000"))
                text, took = self.drip(raw, b" ", 0.05)
                self.assert_told(text, b"less than 1000 bytes per second")
                self.assertLess(took, 20)
            with Raw(server) as raw:
                raw.send(head("/shapedb.v1.ShapeService/WatchIngest", "Content-Type: application/connect+json",
                              "Content-Length: 100000"))
                self.assert_told(raw.rest(), b"neither sent nor read")

    def test_of_uploads_are_cut_off_as_by_grpc(self):
        with serve("--limits-stall-seconds", "2", "--limits-min-bytes-per-second", "1000") as server:
            with Raw(server) as raw:
                header = shapes.AddShapeRequest(header=shapes.AddShapeHeader(key="slow", point_count=100_000))
                chunk = shapes.AddShapeRequest(chunk=types.PointChunk(xyz=b"\0" * 120_000))
                raw.send(head("/shapedb.v1.ShapeService/AddShape", "Content-Type: application/connect+proto",
                              "Content-Length: 1000000").encode() + envelope(header.SerializeToString()))
                text, took = self.drip(raw, envelope(chunk.SerializeToString()), 0.05)
                self.assert_told(text, b"")
                self.assertLess(took, 20)
            self.assertTrue(eventually(lambda: "neither sent nor read" in server.log()), server.log())

    def test_that_do_not_read_are_cut_off(self):
        with serve("--limits-stall-seconds", "2") as server:
            with server.connect() as client:
                client.add("cloud", [(0.1 * i, float(i % 7), (i % 13) / 3.0) for i in range(1_500_000)], wait=False)
            body = envelope(shapes.GetPointsRequest(shape=shapes.ShapeRef(key="cloud")).SerializeToString())
            with Raw(server) as raw:
                raw.send(head("/shapedb.v1.ShapeService/GetPoints", "Content-Type: application/connect+proto",
                              f"Content-Length: {len(body)}").encode() + body)
                self.assertTrue(eventually(lambda: "call rpc=GetPoints" in server.log(), 30), server.log())
                self.assertIn("DEADLINE_EXCEEDED", re.search("call rpc=GetPoints.*", server.log())[0])
            self.assertTrue(answers(server))

    def test_that_are_idle_are_closed(self):
        with serve("--limits-idle-seconds", "1") as server, Raw(server) as raw:
            raw.send(count_request())
            self.assertEqual(raw.status(), 200)
            began = time.monotonic()
            raw.rest()
            self.assertLess(time.monotonic() - began, 10)

    def test_take_no_memory_that_they_announce(self):
        with serve("--limits-max-connections", "500") as server:
            before = server.resident()
            waiting = [Raw(server) for _ in range(300)]
            for raw in waiting:
                raw.send(head(COUNT, JSON, "Content-Length: 4000000") + "{")
            time.sleep(1)
            self.assertLess(server.resident() - before, 60 * MIB)
            self.assertTrue(answers(server))
            for raw in waiting:
                raw.socket.close()


class Connections(unittest.TestCase):
    def test_beyond_their_number_are_closed_at_once(self):
        with serve("--limits-max-connections", "20") as server:
            idle = [Raw(server) for _ in range(60)]
            closed = 0
            for raw in idle:
                raw.socket.settimeout(0.2)
                try:
                    closed += raw.socket.recv(1) == b""
                except ConnectionResetError:
                    closed += 1
                except socket.timeout:
                    pass
            self.assertEqual(closed, 40)
            for raw in idle:
                raw.socket.close()
            self.assertTrue(eventually(lambda: self.served(server)), server.log())
            self.assertIn("too many HTTP connections", server.log())
            with server.connect() as client:
                self.assertEqual(client.count(), 0, "gRPC has places of its own")

    def served(self, server):
        try:
            return answers(server)
        except OSError:
            return False

    def test_that_end_cancel_their_call(self):
        header = shapes.AddShapeRequest(header=shapes.AddShapeHeader(key="k", point_count=1000))
        for end in ("close", "half"):
            with serve("--metrics-listen", "127.0.0.1:0") as server, Raw(server) as raw:
                raw.send(head("/shapedb.v1.ShapeService/AddShape", "Content-Type: application/connect+proto",
                              "Content-Length: 100000").encode() + envelope(header.SerializeToString()))
                self.assertTrue(eventually(lambda: server.begun() == 1))
                raw.socket.close() if end == "close" else raw.socket.shutdown(socket.SHUT_WR)
                self.assertTrue(eventually(lambda: "call rpc=AddShape" in server.log(), 30), end)
                self.assertIn("CANCELLED", re.search("call rpc=AddShape.*", server.log())[0])

    def test_that_end_while_the_server_works_cancel_too(self):
        with serve("--ingest-threads", "1") as server:
            cloud = ball(400_000, 2.0)
            with server.connect() as client:
                for i in range(3):
                    client.add(f"k{i}", cloud, wait=False)
            body = envelope(shapes.WatchIngestRequest(shape=shapes.ShapeRef(key="k2")).SerializeToString())
            with Raw(server) as raw:
                raw.send(head("/shapedb.v1.ShapeService/WatchIngest", "Content-Type: application/connect+proto",
                              f"Content-Length: {len(body)}").encode() + body)
                self.assertEqual(raw.status(), 200)
                raw.socket.shutdown(socket.SHUT_WR)
                self.assertTrue(eventually(lambda: "call rpc=WatchIngest" in server.log(), 30), server.log())
                self.assertIn("CANCELLED", re.search("call rpc=WatchIngest.*", server.log())[0])

    def test_floods_are_refused_by_name_and_pass(self):
        with serve() as server:
            codes = []

            def flood():
                with Http(server) as client:
                    for _ in range(100):
                        codes.append(client.json("ShapeService/CountShapes").status)

            threads = [threading.Thread(target=flood) for _ in range(30)]
            run_together(threads)
            self.assertEqual(len(codes), 3_000)
            self.assertLessEqual(set(codes), {200, 429})

    def test_and_calls_leave_nothing_behind(self):
        """However they end: gRPC's in-process transport keeps calls that were not ended in its way."""
        header = envelope(shapes.AddShapeRequest(header=shapes.AddShapeHeader(key="k", point_count=1000)).SerializeToString())
        wrong = envelope(shapes.AddShapeRequest(header=shapes.AddShapeHeader(key="k", point_count=1)).SerializeToString())

        def work(server, times):
            with Http(server) as client:
                for _ in range(times):
                    client.json("ShapeService/CountShapes")
                    client.json("ShapeService/GetShape", {"shape": {"key": "nobody"}})
                    client.stream("ShapeService/WatchIngest", [{"shape": {"key": "nobody"}}])
            for i in range(times // 2):
                with Raw(server) as raw:  # an upload that is refused, and one whose client goes
                    raw.send(head("/shapedb.v1.ShapeService/AddShape", "Content-Type: application/connect+proto",
                                  "Content-Length: 100000").encode() + (wrong if i % 2 else header))
                    if i % 2:
                        raw.status()

        with serve() as server:
            work(server, 200)
            before = server.resident()
            work(server, 800)
            self.assertLess(server.resident() - before, 5 * MIB)

    def test_a_stop_ends_them_and_lets_answers_finish(self):
        with serve("--ingest-threads", "1") as server:
            with server.connect() as client:
                client.add("big", ball(400_000, 2.0), wait=False)
            idle = Raw(server)
            body = envelope(b'{"shape": {"key": "big"}}')
            with Raw(server) as watching:
                watching.send(head("/shapedb.v1.ShapeService/WatchIngest", "Content-Type: application/connect+json",
                                   f"Content-Length: {len(body)}").encode() + body)
                self.assertEqual(watching.status(), 200)
                began = time.monotonic()
                self.assertEqual(server.stop(), 0)
                self.assertLess(time.monotonic() - began, 15)
                text = watching.rest()
                self.assertTrue("unavailable" in text.decode("latin-1") or "READY" in text.decode("latin-1"), text)
                self.assertTrue(text.endswith(b"0\r\n\r\n"), "the answer is whole")
            self.assertEqual(idle.rest(), b"")
            idle.socket.close()


if __name__ == "__main__":
    main()
