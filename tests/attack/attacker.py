# SPDX-License-Identifier: GPL-3.0-or-later
"""A server to attack, and a client without any of our code: grpcio and generated stubs."""

import math
import os
import re
import resource
import signal
import struct
import subprocess
import sys
import tempfile
import time
import unittest
import urllib.request

# Servers are started while channels are open, and grpcio would wait for these before each fork.
os.environ["GRPC_ENABLE_FORK_SUPPORT"] = "0"

import grpc  # noqa: E402
import health_pb2
import health_pb2_grpc
from shapedb.v1 import admin_service_pb2 as admin
from shapedb.v1 import admin_service_pb2_grpc as admin_grpc
from shapedb.v1 import align_service_pb2 as align
from shapedb.v1 import align_service_pb2_grpc as align_grpc
from shapedb.v1 import collection_service_pb2 as collections
from shapedb.v1 import collection_service_pb2_grpc as collections_grpc
from shapedb.v1 import search_service_pb2 as search
from shapedb.v1 import search_service_pb2_grpc as search_grpc
from shapedb.v1 import shape_service_pb2 as shapes
from shapedb.v1 import shape_service_pb2_grpc as shapes_grpc
from shapedb.v1 import types_pb2 as types

MIB = 1 << 20
CHUNK_POINTS = 80_000  # below the 1 MiB of a chunk


class Server:
    """shapedbd on a free port with a data directory of its own."""

    def __init__(self, *flags, directory=None, open_files=None, memory=None, file_size=None, listen="127.0.0.1:0",
                 first_key=False, prefix=()):
        self._own = tempfile.TemporaryDirectory(prefix="shapedb-attack-")
        self.data = directory or os.path.join(self._own.name, "data")
        self.log_path = os.path.join(self._own.name, "log")
        self._flags = ["--listen", listen, *(flag.replace("{data}", self.data) for flag in flags)]
        if first_key:
            self.key_command("create", "--name", "first", "--role", "admin")
        limits = [f"--{what}={most}" for what, most in (("nofile", open_files), ("as", memory), ("fsize", file_size))
                  if most is not None]
        # Not by a preexec_fn: Python would fork, and threads of grpcio that run meanwhile abort at times.
        self._prefix = [*(["prlimit", *limits] if limits else []), *prefix]
        self.process = None
        try:
            self.start()
        except RuntimeError:
            self._own.cleanup()
            raise

    def start(self):
        with open(self.log_path, "a") as log:
            self.process = subprocess.Popen(
                [*self._prefix, os.environ["SHAPEDBD"], "--data", self.data, *self._flags],
                stdout=subprocess.PIPE, stderr=log, text=True)
        banner = self.process.stdout.readline()
        if not banner.startswith("listening on "):
            self.process.wait()
            self.process.stdout.close()
            raise RuntimeError("the server did not start: " + self.log())
        self.port = int(banner.rsplit(":", 1)[1])
        self.http_port = None
        if "--http-listen" in self._flags:
            self.http_port = int(self.process.stdout.readline().rsplit(":", 1)[1])
        self.address = f"127.0.0.1:{self.port}"

    def key_command(self, *arguments):
        """`shapedbd key`, on the data directory."""
        return subprocess.run([os.environ["SHAPEDBD"], "key", *arguments, "--data", self.data], check=True,
                              capture_output=True, text=True)

    def __enter__(self):
        return self

    def __exit__(self, *error):
        if self.running():
            self.process.kill()
        self.process.wait()
        self.process.stdout.close()
        self._own.cleanup()

    def stop(self):
        self.process.send_signal(signal.SIGTERM)
        self.process.wait(60)
        self.process.stdout.close()
        return self.process.returncode

    def running(self):
        return self.process.poll() is None

    def log(self):
        with open(self.log_path) as log:
            return log.read()

    def resident(self):
        """Bytes of memory in use."""
        with open(f"/proc/{self.process.pid}/statm") as statm:
            return int(statm.read().split()[1]) * resource.getpagesize()

    def peak(self):
        """The most bytes of memory it has used."""
        with open(f"/proc/{self.process.pid}/status") as status:
            for line in status:
                if line.startswith("VmHWM:"):
                    return int(line.split()[1]) * 1024
        raise RuntimeError("no VmHWM")

    def connect(self, **options):
        return Client(self.address, **options)

    def metrics(self):
        """The page of metrics; takes --metrics-listen."""
        port = re.search(r"""metrics are served.*port"?[=:](\d+)""", self.log())[1]
        with urllib.request.urlopen(f"http://127.0.0.1:{port}/metrics", timeout=30) as page:
            return page.read().decode()

    def begun(self, kind="upload"):
        """How many calls of this kind have begun and run; takes --metrics-listen."""
        return int(re.search(rf'^shapedb_calls_running\{{kind="{kind}"\}} (\d+)', self.metrics(), re.MULTILINE)[1])


class Bearer(grpc.UnaryUnaryClientInterceptor, grpc.UnaryStreamClientInterceptor, grpc.StreamUnaryClientInterceptor,
             grpc.StreamStreamClientInterceptor):
    """Sends an API key with every call."""

    def __init__(self, key):
        self._metadata = [("authorization", key if " " in key else "Bearer " + key)]

    def _send(self, continuation, details, request):
        return continuation(details._replace(metadata=[*(details.metadata or ()), *self._metadata]), request)

    intercept_unary_unary = intercept_unary_stream = intercept_stream_unary = intercept_stream_stream = _send


class Client:
    def __init__(self, address, compression=None, key=None, credentials=None, options=()):
        # A channel of its own connection: by default channels to one address share one.
        options = [("grpc.use_local_subchannel_pool", 1), ("grpc.max_send_message_length", -1), *options]
        if credentials is None:
            self._connection = grpc.insecure_channel(address, options=options, compression=compression)
        else:
            self._connection = grpc.secure_channel(address, credentials, options=options, compression=compression)
        self.channel = grpc.intercept_channel(self._connection, *([Bearer(key)] if key else []))
        self.shapes = shapes_grpc.ShapeServiceStub(self.channel)
        self.search = search_grpc.SearchServiceStub(self.channel)
        self.align = align_grpc.AlignServiceStub(self.channel)
        self.collections = collections_grpc.CollectionServiceStub(self.channel)
        self.admin = admin_grpc.AdminServiceStub(self.channel)
        self.health = health_pb2_grpc.HealthStub(self.channel)

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self._connection.close()

    def serving(self, service=""):
        reply = self.health.Check(health_pb2.HealthCheckRequest(service=service), timeout=10)
        return reply.status == health_pb2.HealthCheckResponse.SERVING

    def count(self, timeout=30):
        return self.shapes.CountShapes(shapes.CountShapesRequest(), timeout=timeout).count

    def add(self, key, points, wait=True, timeout=120, **header):
        return self.shapes.AddShape(upload(key, points, wait=wait, **header), timeout=timeout)


class SecuredServer(Server):
    """Demands keys, and has a Unix socket for its own admin."""

    def __init__(self, *flags, **options):
        super().__init__("--security-keys", "always", "--unix-socket", "{data}.sock", *flags, first_key=True,
                         **options)

    def local(self):
        return Client("unix:" + self.data + ".sock")

    def make(self, role, name="test", **spec):
        with self.local() as client:
            return client.admin.CreateKey(admin.CreateKeyRequest(name=name, role=role, **spec), timeout=10)


def ball(points=2_000, stretch=1.0):
    """Points on an ellipsoid, evenly, as a list of (x, y, z)."""
    golden = math.pi * (3.0 - math.sqrt(5.0))
    cloud = []
    for i in range(points):
        z = 1.0 - 2.0 * (i + 0.5) / points
        r = math.sqrt(1.0 - z * z)
        cloud.append((stretch * r * math.cos(golden * i), r * math.sin(golden * i), z))
    return cloud


def pack(points):
    return b"".join(struct.pack("<fff", *p) for p in points)


def upload(key, points, wait=False, **header):
    """The messages of an AddShape."""
    yield shapes.AddShapeRequest(
        header=shapes.AddShapeHeader(key=key, point_count=len(points), wait=wait, **header))
    for first in range(0, len(points), CHUNK_POINTS):
        xyz = pack(points[first:first + CHUNK_POINTS])
        yield shapes.AddShapeRequest(chunk=types.PointChunk(xyz=xyz))


def reason(error):
    """Our name of an error; None without one."""
    for key, value in error.trailing_metadata() or ():
        if key == "shapedb-error":
            return value
    return None


def limits_of(client):
    reply = client.admin.ServerInfo(admin.ServerInfoRequest(), timeout=10)
    return {limit.name: limit for limit in reply.limit_table}


def eventually(condition, seconds=60):
    until = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > until:
            return False
        time.sleep(0.05)
    return True


def run_together(threads):
    """Until all have ended."""
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()


def main():
    sys.stdout.reconfigure(line_buffering=True)
    unittest.main(verbosity=2)
