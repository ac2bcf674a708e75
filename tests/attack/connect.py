# SPDX-License-Identifier: GPL-3.0-or-later
"""HTTP as a stranger would send it: plain sockets and http.client, and the Connect protocol on top of it."""

import http.client
import json
import socket
import ssl
import struct

from attacker import SecuredServer, Server, grpc

HTTP = ("--http-listen", "127.0.0.1:0")
JSON = "Content-Type: application/json"
COUNT = "/shapedb.v1.ShapeService/CountShapes"
CODES = {code.name.lower(): code for code in grpc.StatusCode}
CODES["canceled"] = CODES["cancelled"]  # as the protocol spells it


def envelope(message, flags=0):
    return struct.pack(">BI", flags, len(message)) + message


def envelopes(data):
    """[(flags, message)]; fails if the last one is cut off."""
    found = []
    while data:
        flags, size = struct.unpack(">BI", data[:5])
        assert len(data) >= 5 + size, "an envelope is cut off"
        found.append((flags, data[5:5 + size]))
        data = data[5 + size:]
    return found


class Answer:
    def __init__(self, response):
        self.status = response.status
        self.headers = {name.lower(): value for name, value in response.getheaders()}
        self.body = response.read()

    def json(self):
        return json.loads(self.body)

    def stream(self):
        """The messages, and the end of the stream."""
        parts = envelopes(self.body)
        assert parts and parts[-1][0] == 2 and all(flags == 0 for flags, _ in parts[:-1]), self.body
        return [message for _, message in parts[:-1]], json.loads(parts[-1][1])

    def error(self):
        """{"code", "message", ...}, or None."""
        if self.headers["content-type"].startswith("application/connect+"):
            return self.stream()[1].get("error")
        return None if self.status == 200 else self.json()


class Http:
    """A client of one server, with one connection."""

    def __init__(self, server, key=None, authority=None):
        self._key = key
        if authority is None:
            self.connection = http.client.HTTPConnection("127.0.0.1", server.http_port, timeout=60)
        else:
            self.connection = http.client.HTTPSConnection(
                "localhost", server.http_port, timeout=60, context=ssl.create_default_context(cafile=authority))

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self.connection.close()

    def request(self, method, path, body=None, chunked=False, **headers):
        fields = {name.replace("_", "-"): value for name, value in headers.items()}
        if self._key and "authorization" not in fields:
            fields["authorization"] = "Bearer " + self._key
        if chunked:
            fields["transfer-encoding"] = "chunked"
        self.connection.request(method, path, body=body, headers=fields, encode_chunked=chunked)
        answer = Answer(self.connection.getresponse())
        return answer

    def json(self, path, message=None, **headers):
        """A unary call; `path` is SERVICE/METHOD."""
        return self.request("POST", "/shapedb.v1." + path, json.dumps(message or {}),
                            content_type="application/json", **headers)

    def stream(self, path, messages, **headers):
        """A call of envelopes: of messages of generated classes in protobuf, or of dictionaries in JSON."""
        messages = list(messages)
        as_json = bool(messages) and isinstance(messages[0], dict)
        parts = [envelope(json.dumps(m).encode() if as_json else m.SerializeToString()) for m in messages]
        return self.request("POST", "/shapedb.v1." + path, iter(parts), chunked=True,
                            content_type="application/connect+" + ("json" if as_json else "proto"), **headers)

    def call(self, service, method, messages):
        """Any rpc by its description, in protobuf; the status code, as of gRPC."""
        path = service.name + "/" + method.name
        if method.client_streaming or method.server_streaming:
            answer = self.stream(path, messages)
        else:
            answer = self.request("POST", "/shapedb.v1." + path, messages[0].SerializeToString(),
                                  content_type="application/proto")
        error = answer.error()
        if answer.headers.get("connection") == "close":
            self.connection.close()
        return grpc.StatusCode.OK if error is None else CODES[error["code"]]


class Raw:
    """Bytes, and nothing else."""

    def __init__(self, server, timeout=30):
        self.socket = socket.create_connection(("127.0.0.1", server.http_port), timeout=timeout)

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self.socket.close()

    def send(self, data):
        self.socket.sendall(data if isinstance(data, bytes) else data.encode("latin-1"))
        return self

    def rest(self):
        """Everything until the server closes."""
        data = b""
        try:
            while piece := self.socket.recv(65_536):
                data += piece
        except ConnectionResetError:
            pass
        return data

    def status(self):
        """Of the next answer."""
        data = b""
        while b"\r\n" not in data:
            piece = self.socket.recv(1)
            if not piece:
                return None
            data += piece
        return int(data.split(b" ")[1])


def head(path, *fields, method="POST", host="localhost"):
    lines = [f"{method} {path} HTTP/1.1", f"Host: {host}", *fields, "", ""]
    return "\r\n".join(lines)


def serve(*flags, **options):
    return Server(*HTTP, *flags, **options)


def secured(*flags, **options):
    return SecuredServer(*HTTP, *flags, **options)


def count_request(*fields, body="{}", host="localhost"):
    return head(COUNT, JSON, f"Content-Length: {len(body)}", *fields, host=host) + body


def answers(server):
    with Http(server) as client:
        return client.json("ShapeService/CountShapes").status == 200
