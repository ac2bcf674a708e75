# SPDX-License-Identifier: GPL-3.0-or-later
"""HTTP and the Connect protocol: that every call works, that no rule of gRPC is missing, and who may do what."""

import base64
import gzip
import json
import os
import re
import subprocess
import tempfile
import time
import unittest

from attacker import SecuredServer, Server, admin, ball, collections, eventually, grpc, main, pack, shapes, upload
from connect import COUNT, HTTP, JSON, Http, Raw, answers, count_request, envelope, head, secured, serve
from rpcs import ADMIN, COLLECTION, READER, RULES, WHOLE_SERVER, WRITER, methods, request_of
from tls_test import Certificates

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))


class Calls(unittest.TestCase):
    def test_of_every_service_work_in_json(self):
        points = ball()
        xyz = base64.b64encode(pack(points)).decode()
        with serve() as server, Http(server) as client:
            made = client.json("CollectionService/CreateCollection", {"name": "parts"})
            self.assertEqual((made.status, made.json()["name"]), (200, "parts"))
            header = {"collection": "parts", "key": "ball", "pointCount": len(points), "wait": True,
                      "metadata": {"label": "ball"}}
            added, end = client.stream("ShapeService/AddShape", [{"header": header}, {"chunk": {"xyz": xyz}}]).stream()
            self.assertEqual(end, {})
            self.assertEqual(json.loads(added[0])["shape"]["state"], "SHAPE_STATE_READY")
            self.assertIsNone(client.stream("ShapeService/AddShape", upload(
                "egg", ball(stretch=1.5), wait=True, collection="parts")).error())
            ref = {"shape": {"collection": "parts", "key": "ball"}}
            self.assertEqual(client.json("ShapeService/GetShape", ref).json()["shape"]["metadata"], {"label": "ball"})
            events, _ = client.stream("ShapeService/WatchIngest", [ref]).stream()
            self.assertEqual(json.loads(events[-1])["state"], "SHAPE_STATE_READY")
            options = {"options": {"collection": "parts", "k": 1}}
            found = client.json("SearchService/SearchByKey", {"key": "ball", **options}).json()
            self.assertEqual(found["hits"][0]["shape"]["key"], "egg")
            hits, _ = client.stream("SearchService/SearchByScan",
                                    [{"header": {"pointCount": len(points), **options}}, {"chunk": {"xyz": xyz}}]).stream()
            self.assertEqual(json.loads(hits[0])["hits"][0]["shape"]["key"], "ball")
            laid, _ = client.stream("AlignService/Align", [
                {"header": {"queryPoints": len(points), "key": ref["shape"]}}, {"chunk": {"xyz": xyz}}]).stream()
            self.assertTrue(json.loads(laid[0]))
            progress, end = client.stream("AdminService/Rebuild", [{"collection": "parts"}]).stream()
            self.assertEqual((bool(progress), end), (True, {}))
            self.assertEqual(client.json("AdminService/Stats").json()["collections"], "2")
            gone = client.json("ShapeService/DeleteShape", ref)
            self.assertEqual(gone.status, 200)
            missing = client.json("ShapeService/GetShape", ref)
            self.assertEqual((missing.status, missing.json()["code"]), (404, "not_found"))
            self.assertEqual(missing.headers["trailer-shapedb-error"], "not_found")

    def test_carry_points_bit_for_bit(self):
        points = [(0.1 * i, float(i % 7), (i % 13) / 3.0) for i in range(200_000)]
        with serve() as server, Http(server) as client:
            added = client.stream("ShapeService/AddShape", upload("cloud", points))
            self.assertIsNone(added.error())
            parts, end = client.stream("ShapeService/GetPoints", [shapes.GetPointsRequest(
                shape=shapes.ShapeRef(key="cloud"))]).stream()
            self.assertEqual(end, {})
            xyz = b"".join(shapes.StoredPoints.FromString(part).chunk.xyz for part in parts)
            self.assertEqual(xyz, pack(points))

    def test_keep_their_connection_and_their_order(self):
        with serve() as server, Raw(server) as raw:
            raw.send(count_request() * 3 + head("/healthz", "Connection: close", method="GET"))
            text = raw.rest()
            self.assertEqual(text.count(b"HTTP/1.1 200 OK"), 4, text)
            self.assertTrue(text.endswith(b'{"status":"SERVING"}\n'), text)

    def test_have_a_deadline(self):
        with serve("--ingest-threads", "1") as server, Http(server) as client:
            self.assertEqual(client.json("ShapeService/CountShapes", connect_timeout_ms="5000").status, 200)
            began = time.monotonic()
            header = shapes.AddShapeRequest(header=shapes.AddShapeHeader(key="k", point_count=1000))
            with Raw(server) as raw:
                body = envelope(header.SerializeToString())
                raw.send(head("/shapedb.v1.ShapeService/AddShape", "Content-Type: application/connect+proto",
                              "Content-Length: 100000", "Connect-Timeout-Ms: 1000").encode() + body)
                self.assertIn(b"deadline_exceeded", raw.rest())
            self.assertLess(time.monotonic() - began, 10)

    def test_are_logged_with_the_address_of_the_client(self):
        trace = "0af7651916cd43dd8448eb211c80319c"
        with serve() as server, Http(server) as client:
            client.json("ShapeService/CountShapes", traceparent=f"00-{trace}-b7ad6b7169203331-01")
            port = client.connection.sock.getsockname()[1]
            line = re.search(r"call rpc=CountShapes .*", server.log())[0]
            self.assertIn(f"peer=ipv4:127.0.0.1:{port} ", line)
            self.assertIn("via=http", line)
            self.assertIn("trace=" + trace, line)

    def test_that_do_not_exist_are_told_apart(self):
        with serve() as server, Http(server) as client:
            for path in ("ShapeService/Nothing", "NoService/GetShape", "ShapeService/", "ShapeService/GetShape/"):
                answer = client.json(path)
                self.assertEqual((answer.status, answer.json()["code"]), (404, "unimplemented"), path)
            self.assertEqual(client.request("GET", COUNT).headers["allow"], "POST")
            self.assertEqual(client.request("POST", "/").status, 405)
            self.assertEqual(client.request("DELETE", "/healthz").status, 405)
            self.assertEqual(client.request("POST", "/grpc.health.v1.Health/Check", content_type="application/json",
                                            body="{}").status, 405)


class Roles(unittest.TestCase):
    def test_are_those_of_grpc(self):
        with secured() as server:
            with server.local() as local:
                for name in ("open", "closed"):
                    local.collections.CreateCollection(collections.CreateCollectionRequest(name=name), timeout=10)
            keys = {(role, some): Http(server, server.make(role, collections=["open"] if some else []).secret)
                    for role in (READER, WRITER, ADMIN) for some in (False, True)}
            for service, method in methods():
                needed, touches = RULES[service.name][method.name]
                for key in (None, "shapedb_1_2"):
                    with Http(server, key) as stranger, self.subTest(rpc=method.name, key=key):
                        self.assertEqual(stranger.call(service, method, request_of(method, "open")),
                                         grpc.StatusCode.UNAUTHENTICATED)
                for (role, some), client in keys.items():
                    with self.subTest(rpc=method.name, role=role, some=some):
                        code = client.call(service, method, request_of(method, "closed"))
                        denied = role < needed or (some and touches in (WHOLE_SERVER, COLLECTION))
                        self.assertEqual(code == grpc.StatusCode.PERMISSION_DENIED, denied, code)
                        self.assertNotIn(code, (grpc.StatusCode.UNAUTHENTICATED, grpc.StatusCode.INTERNAL))
                with server.local() as local:
                    try:
                        local.collections.CreateCollection(collections.CreateCollectionRequest(name="closed"), timeout=10)
                    except grpc.RpcError:
                        pass
            for client in keys.values():
                client.connection.close()

    def test_say_what_is_wanted_before_an_upload_arrives(self):
        with secured() as server, Raw(server) as raw:
            raw.send(head("/shapedb.v1.ShapeService/AddShape", "Content-Type: application/connect+proto",
                          "Content-Length: 100000000"))
            self.assertIn(b'"unauthenticated"', raw.rest())
        with secured() as server, Http(server) as client:
            answer = client.json("ShapeService/CountShapes")
            self.assertEqual((answer.status, answer.headers["www-authenticate"]), (401, "Bearer"))

    def test_nobody_is_the_local_administrator(self):
        with serve("--unix-socket", "{data}.sock") as server, Http(server) as client:
            self.assertEqual(client.json("AdminService/CreateKey", {"name": "mine", "role": "ROLE_ADMIN"}).status, 401)
            self.assertEqual(client.json("AdminService/ListKeys").status, 401)

    def test_refusals_are_audited(self):
        with secured() as server, Http(server) as client:
            client.json("AdminService/Stats")
            port = client.connection.sock.getsockname()[1]
            with open(server.data + "/audit.refused.log") as log:
                line = json.loads(log.read().splitlines()[-1])
            self.assertEqual((line["rpc"], line["peer"], line["via"]), ("Stats", f"ipv4:127.0.0.1:{port}", "http"))

    def test_no_secret_is_told(self):
        with secured("--log-level", "trace") as server:
            key = server.make(READER)
            secret = key.secret.rsplit("_", 1)[1]
            for presented in (key.secret, key.secret[:-4] + "beef"):
                with Http(server, presented) as client:
                    self.assertNotIn(secret[:16], client.json("AdminService/Stats").body.decode())
            self.assertNotIn(secret[:16], server.log())

    def test_limits_of_keys_say_when_to_come_back(self):
        with secured() as server:
            with Http(server, server.make(READER, limits=admin.KeyLimits(calls_per_second=1)).secret) as client:
                told = [client.json("ShapeService/CountShapes") for _ in range(6)]
            refused = [answer for answer in told if answer.status == 429]
            self.assertGreaterEqual(len(refused), 3)
            self.assertEqual(refused[0].headers["retry-after"], "1")
            self.assertEqual(refused[0].headers["trailer-shapedb-error"], "rate_limited")
            self.assertLessEqual(int(refused[0].json()["details"][0]["debug"]["retryAfterMs"]), 1_000)


class Spoofing(unittest.TestCase):
    def test_an_address_counts_only_from_inside(self):
        forged = "ipv4:6.6.6.6:666"
        with serve() as server:
            with server.connect() as client:
                for secret in ("", "0" * 64, "x"):
                    client.shapes.CountShapes(shapes.CountShapesRequest(), timeout=10, metadata=(
                        ("shapedb-inside", secret), ("shapedb-peer", forged)))
            with Http(server) as client:
                client.json("ShapeService/CountShapes", shapedb_inside="x", shapedb_peer=forged, x_forwarded_for="6.6.6.6",
                            forwarded="for=6.6.6.6")
            self.assertEqual(server.log().count("call rpc=CountShapes peer=ipv4:127.0.0.1:"), 4, server.log())
            self.assertNotIn("6.6.6.6", server.log())

    def test_metadata_that_grpc_would_not_take_do_no_harm(self):
        with serve() as server:
            for name in ("Authorization", "Traceparent", "Shapedb-Peer", "Grpc-Timeout", "Te", "Content-Type"):
                for value in (b"Bearer \x80\xff", b"a\tb", b"\xc3\xa9" * 100, b"x" * 8_000):
                    with Raw(server) as raw:
                        raw.send(head(COUNT, JSON, "Content-Length: 2", "Connection: close")[:-2].encode()
                                 + name.encode() + b": " + value + b"\r\n\r\n{}")
                        raw.rest()
            self.assertTrue(answers(server), server.log())


class Browsers(unittest.TestCase):
    def test_pages_of_others_can_do_nothing(self):
        with serve() as server:
            for host in ("evil.example", f"evil.example:{server.http_port}", "localhost.evil.example", ""):
                with Raw(server) as raw:
                    self.assertEqual(raw.send(count_request(host=host)).status(), 421, host)
                with Raw(server) as raw:
                    self.assertEqual(raw.send(head("/", method="GET", host=host)).status(), 421, host)
            with Http(server) as client:
                crossed = client.json("ShapeService/CountShapes", origin="http://evil.example")
                self.assertEqual((crossed.status, crossed.json()["code"]), (403, "permission_denied"))
                own = client.json("ShapeService/CountShapes", origin=f"http://127.0.0.1:{server.http_port}")
                self.assertEqual(own.status, 200)
                asked = client.request("OPTIONS", COUNT, origin="http://evil.example",
                                       access_control_request_method="POST")
                self.assertEqual(asked.status, 405)
                for answer in (crossed, own, asked):
                    self.assertFalse([name for name in answer.headers if name.startswith("access-control-")])
                for kind in ("text/plain", "application/x-www-form-urlencoded", "multipart/form-data"):
                    self.assertEqual(client.request("POST", COUNT, "{}", content_type=kind).status, 415)

    def test_a_server_has_the_names_it_is_given(self):
        with serve("--http-hosts", "shapes.example,other.example") as server:
            for host, status in (("shapes.example", 200), ("other.example:80", 200), ("evil.example", 421)):
                with Raw(server) as raw:
                    self.assertEqual(raw.send(count_request(host=host)).status(), status, host)
        with secured() as server, Raw(server) as raw:
            self.assertEqual(raw.send(count_request(host="any.example")).status(), 401, "a key is wanted anyway")

    def test_the_page_is_served_and_closed_up(self):
        with serve() as server, Http(server) as client:
            page = client.request("GET", "/", accept_encoding="gzip")
            self.assertIn(b"<title>ShapeDB", gzip.decompress(page.body))
            self.assertIn("default-src 'none'", page.headers["content-security-policy"])
            self.assertEqual(client.request("GET", "/", if_none_match=page.headers["etag"]).status, 304)
            first = client.request("HEAD", "/")
            self.assertEqual((first.status, first.body), (200, b""))
            for path in ("/nothing", "/../../etc/passwd", "/%2e%2e/", "/index.html%00"):
                self.assertEqual(client.request("GET", path).status, 404, path)


class Tls(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="shapedb-http-")
        self.addCleanup(folder.cleanup)
        self.certificates = Certificates(folder.name)
        for name in ("first", "second", "client"):
            self.certificates.sign(name)
        self.install("first")
        self.files = ("--tls-certificate", self.certificates.path("server.pem"), "--tls-key",
                      self.certificates.path("server.key"))

    def install(self, name):
        self.certificates.install(name, "pem")
        self.certificates.install(name, "key")

    def subject(self, server):
        shown = subprocess.run(["openssl", "s_client", "-connect", f"127.0.0.1:{server.http_port}"], input=b"",
                               capture_output=True).stdout
        return subprocess.run(["openssl", "x509", "-noout", "-subject"], input=shown, capture_output=True,
                              check=True).stdout.decode()

    def test_beyond_loopback_only_with_tls_and_a_key(self):
        with self.assertRaises(RuntimeError) as error:
            Server("--http-listen", "0.0.0.0:0")
        self.assertIn("http.listen = 0.0.0.0:0 can be reached from other machines", str(error.exception))
        with self.assertRaises(RuntimeError) as error:
            Server("--http-listen", "0.0.0.0:0", *self.files)
        self.assertIn("shapedbd key create", str(error.exception))

    def test_serves_curl_and_refuses_who_does_not_speak_it(self):
        with SecuredServer("--http-listen", "0.0.0.0:0", *self.files) as server:
            key = server.make(READER).secret
            address = f"https://localhost:{server.http_port}"
            run = subprocess.run(["curl", "-sS", "--cacert", self.certificates.path("ca.pem"), "-H", JSON, "-H",
                                  "Authorization: Bearer " + key, "-d", "{}", address + COUNT], capture_output=True)
            self.assertEqual((run.stdout, run.stderr), (b"{}", b""))
            with Http(server, authority=self.certificates.path("ca.pem")) as stranger:
                self.assertEqual(stranger.json("ShapeService/CountShapes").status, 401)
            with Raw(server, timeout=15) as plain:
                self.assertNotIn(b"HTTP/1.1", plain.send(count_request()).rest())
            with Raw(server, timeout=15) as mute:
                began = time.monotonic()
                self.assertEqual(mute.rest(), b"")
                self.assertLess(time.monotonic() - began, 14, "a handshake has ten seconds")
            old = subprocess.run(["openssl", "s_client", "-connect", f"127.0.0.1:{server.http_port}", "-tls1_1"], input=b"",
                                 capture_output=True)
            self.assertNotEqual(old.returncode, 0)

    def test_certificates_are_replaced_under_large_uploads(self):
        cloud = [(0.1 * i, float(i % 7), (i % 13) / 3.0) for i in range(300_000)]
        with SecuredServer(*HTTP, *self.files) as server:
            key = server.make(WRITER).secret
            authority = self.certificates.path("ca.pem")
            self.assertIn("first", self.subject(server))
            with Http(server, key, authority=authority) as lasting:
                self.assertIsNone(lasting.stream("ShapeService/AddShape", upload("a", cloud)).error())
                self.install("second")
                self.assertTrue(eventually(lambda: "second" in self.subject(server), 30))
                self.assertEqual(lasting.json("ShapeService/CountShapes").json(), {"count": "1"})
                parts, end = lasting.stream("ShapeService/GetPoints", [shapes.GetPointsRequest(
                    shape=shapes.ShapeRef(key="a"))]).stream()
                self.assertEqual(end, {})
                self.assertEqual(b"".join(shapes.StoredPoints.FromString(part).chunk.xyz for part in parts), pack(cloud))
            with Http(server, key, authority=authority) as fresh:
                self.assertEqual(fresh.json("ShapeService/CountShapes").json(), {"count": "1"})

    def test_clients_may_have_to_show_a_certificate(self):
        path = self.certificates.path
        with SecuredServer(*HTTP, *self.files, "--tls-client-ca", path("ca.pem")) as server:
            curl = ["curl", "-sS", "--cacert", path("ca.pem"), "-H", JSON, "-d", "{}", "-H",
                    "Authorization: Bearer " + server.make(READER).secret,
                    f"https://localhost:{server.http_port}{COUNT}"]
            self.assertNotEqual(subprocess.run(curl, capture_output=True).returncode, 0)
            shown = subprocess.run([*curl, "--cert", path("client.pem"), "--key", path("client.key")], capture_output=True)
            self.assertEqual((shown.stdout, shown.stderr), (b"{}", b""))


if __name__ == "__main__":
    main()
