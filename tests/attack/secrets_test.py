# SPDX-License-Identifier: GPL-3.0-or-later
"""A secret that is sent where it does not belong: as a name, a filter, metadata. It is written nowhere that others read."""

import copy
import glob
import json
import unittest
import urllib.request

from attacker import SecuredServer, eventually, grpc, main
from connect import HTTP, Http, Raw, head
from rpcs import ADMIN, methods, request_of

WINDOW = 12  # digits of a secret that must not be anywhere


def texts(descriptor, path=()):
    """Where a message has text: paths of fields."""
    for field in descriptor.fields:
        here = (*path, field)
        kind = field.message_type
        if field.type == field.TYPE_STRING:
            yield here
        elif kind and kind not in [f.message_type for f in path]:
            yield from texts(kind, here)


def put(message, path, value):
    """Sets the text at the path; of what is repeated, the first."""
    for field in path[:-1]:
        at = getattr(message, field.name)
        if field.message_type.GetOptions().map_entry:
            at[value] = value
            return
        message = at.add() if field.label == field.LABEL_REPEATED else at
    if path[-1].label == path[-1].LABEL_REPEATED:
        getattr(message, path[-1].name).append(value)
    else:
        setattr(message, path[-1].name, value)


def variants(method, value):
    """The request as it should be, with the value at one place after the other, then at all."""
    paths = list(texts(method.input_type))
    for chosen in [[path] for path in paths] + [paths]:
        sends = copy.deepcopy(request_of(method, "bones"))
        for path in chosen:
            put(sends[0], path, value)
        yield sends


def failure_of(channel, service, method, sends, metadata=()):
    """What the client is told; empty if nothing is wrong."""
    kind = ("stream" if method.client_streaming else "unary") + "_" + (
        "stream" if method.server_streaming else "unary")
    make = getattr(channel, kind)(f"/{service.full_name}/{method.name}",
                                  request_serializer=method.input_type._concrete_class.SerializeToString,
                                  response_deserializer=method.output_type._concrete_class.FromString)
    try:
        answer = make(iter(sends) if method.client_streaming else sends[0], timeout=30, metadata=metadata)
        if method.server_streaming:
            list(answer)
        return ""
    except grpc.RpcError as error:
        return f"{error.details()} {error.trailing_metadata()}"


class Secrets(unittest.TestCase):
    def assert_absent(self, text, where):
        text = text.lower()
        for at in range(0, len(self.secret) - WINDOW + 1):
            self.assertNotIn(self.secret[at:at + WINDOW], text, where)

    def by_grpc(self, server, key):
        """Every rpc with the key at every place where it has text, by its holder and by a stranger."""
        calls = 0
        for caller in (key.secret, None):
            with server.connect(key=caller) as client:
                for service, method in methods():
                    for value in (key.secret, "a/" + key.secret.upper() + " or ("):
                        for sends in variants(method, value):
                            told = failure_of(client.channel, service, method, sends)
                            self.assert_absent(told, f"the error of {method.name}: {told}")
                            calls += 1
        return calls

    def by_metadata(self, server, key):
        with server.connect() as client:
            service, method = next(methods())
            for name in ("traceparent", "authorization", "user-agent", "x-key", "key", "shapedb-peer"):
                for value in (key.secret, "Bearer  " + key.secret, "Basic " + key.secret):
                    told = failure_of(client.channel, service, method, request_of(method, "bones"), ((name, value),))
                    self.assert_absent(told, name)

    def by_http(self, server, key):
        with Http(server, key.secret) as client:
            for path in ("ShapeService/" + key.secret, key.secret, "ShapeService/CountShapes?key=" + key.secret):
                self.assert_absent(client.json(path).body.decode(), path)
            for body in ({key.secret: 1}, {"collection": key.secret}, {"filter": key.secret}, {"filter": [key.secret]},
                         {"collection": {"x": key.secret}}):
                told = client.json("ShapeService/CountShapes", body).body.decode()
                self.assert_absent(told, told)
            for body in (key.secret, '{"collection": ' + key.secret, '{"collection" "' + key.secret):
                told = client.request("POST", "/shapedb.v1.ShapeService/CountShapes", body,
                                      content_type="application/json").body.decode()
                self.assert_absent(told, told)
            told = client.request("POST", "/shapedb.v1.ShapeService/CountShapes", "{}", content_type=key.secret,
                                  connect_timeout_ms=key.secret).body.decode()
            self.assert_absent(told, told)
        for request in (head("/" + key.secret, method="GET"), head("/x", "Expect: " + key.secret),
                        head("/x", f"{key.secret}: 1", "Transfer-Encoding: " + key.secret),
                        f"{key.secret} / HTTP/1.1\r\n\r\n", f"GET / {key.secret}\r\n\r\n"):
            with Raw(server) as raw:
                raw.send(request).socket.shutdown(1)
                self.assert_absent(raw.rest().decode("latin-1"), request)

    def test_are_masked_wherever_a_client_puts_them(self):
        with SecuredServer("--log-level", "trace", "--log-format", "json", "--metrics-listen", "127.0.0.1:0",
                           *HTTP) as server:
            key = server.make(ADMIN)
            self.secret = key.secret.rsplit("_", 1)[1]
            calls = self.by_grpc(server, key)
            self.by_metadata(server, key)
            self.by_http(server, key)
            self.assertGreater(calls, 300)
            lines = [json.loads(line) for line in server.log().splitlines()]
            port = next(line["port"] for line in lines if line["message"] == "metrics are served")
            with urllib.request.urlopen(f"http://127.0.0.1:{port}/metrics", timeout=10) as page:
                self.assert_absent(page.read().decode(), "metrics")
            self.assertEqual(server.stop(), 0)
            self.assertIn(f"shapedb_{key.key.id}_***", server.log())
            written = [server.log_path, *glob.glob(server.data + "/audit*")]
            self.assertGreater(len(written), 2)
            for path in written:
                with open(path) as content:
                    for line in content:
                        self.assert_absent(line, path + ": " + line)


if __name__ == "__main__":
    main()
