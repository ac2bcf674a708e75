# SPDX-License-Identifier: GPL-3.0-or-later
"""Several servers that hold the shards of one database between them, and what is known of their content."""

import contextlib
import random
import select
import socket
import threading
import time

from attacker import Server, admin, eventually, grpc, reason, shapes
from kill_test import CLOUDS, HASHES
from shared_kills import ANCHOR, Known, Searchers, searched, serving

LEASE = 1.0  # seconds
TIMEOUT = 4  # seconds that the database may take to answer
SEARCH = "shapedb.v1.SearchService"


class Cluster:
    def __init__(self, database, names=("one", "two", "three"), replicas=1, flags=(), uri=None, uris=None,
                 own_flags=None):
        """On a Postgres. `uri`: if not an empty database of it; `uris`, `own_flags`: of single servers, by name."""
        self.uri = uri = uri or database.another()
        self.known = {}
        self.servers = {}
        self.clients = {}
        self.number = 0
        self._stack = contextlib.ExitStack()
        self._start = lambda name: Server(
            "--store-engine", "postgres", "--postgres-uri", (uris or {}).get(name, uri), "--postgres-server-name", name,
            "--postgres-timeout-seconds", str(TIMEOUT), "--postgres-job-lease-seconds", "2", "--cluster-replicas",
            str(replicas), "--cluster-lease-milliseconds", str(int(1000 * LEASE)), *flags,
            *(own_flags or {}).get(name, ()))
        try:
            for name in names:
                self.servers[name] = self._stack.enter_context(self._start(name))
                self.clients[name] = self._stack.enter_context(self.servers[name].connect())
            self.write(names[0], ANCHOR, True)
            # Each has its part, and knows of the others.
            held = "SELECT count(*) FROM cluster_slot WHERE holder <> '' GROUP BY holder HAVING count(*) > 64"
            if not eventually(lambda: len(database.query(held, uri).split()) == len(names)
                              and serving(self.servers.values()), 30):
                raise RuntimeError("shards have no server")
        except BaseException:
            self._stack.close()
            raise

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self._stack.close()

    def another(self, name):
        """One more server, which may not start."""
        return self._start(name)

    def write(self, name, key, wait=False, timeout=60):
        """Stores a shape by a server, or another in its place; the seconds it took."""
        self.number += 1
        which = self.number % len(CLOUDS)
        value = (HASHES[which], str(self.number))
        known = self.known.setdefault(key, Known(None))
        known.ask(value)
        began = time.monotonic()
        self.clients[name].add(key, CLOUDS[which], wait=wait, timeout=timeout, metadata={"note": value[1]})
        known.acknowledge(value, wait)
        return time.monotonic() - began

    def delete(self, name, key):
        self.known[key].ask(None)
        self.clients[name].shapes.DeleteShape(shapes.DeleteShapeRequest(shape=shapes.ShapeRef(key=key)), timeout=60)
        self.known[key].acknowledge(None)

    def fill(self, name, count):
        for i in range(count):
            self.write(name, f"shape {i}")
        self.settle(name)

    def settle(self, name):
        """Until all scans are segmented; none may fail."""
        def stats():
            return self.clients[name].admin.Stats(admin.StatsRequest(), timeout=30)

        if not eventually(lambda: stats().shapes_pending == 0, 60) or stats().shapes_failed:
            raise RuntimeError(f"pending: {stats().shapes_pending}, failed: {stats().shapes_failed}")
        for known in self.known.values():
            known.searched = True

    def searchers(self, *names):
        return Searchers([self.servers[name] for name in names or self.servers], self.known)

    def look(self, name):
        """What a search by this server finds: {key: what is stored}."""
        return searched(self.clients[name])

    def expected(self):
        return {key: known.possible[0] for key, known in self.known.items() if known.possible[0] is not None}


class Changes:
    """A client that adds, replaces and deletes by one server all the time, until its `stop`."""

    def __init__(self, cluster, name):
        self.cluster = cluster
        self.name = name
        self.acknowledged = 0
        self.refused = []  # (gRPC code, our name of it, the message, seconds)
        self.over = threading.Event()
        self.last = time.monotonic()
        self.longest = 0.0  # seconds between two that were acknowledged
        self.thread = threading.Thread(target=self.run)
        self.thread.start()

    def run(self):
        turn = 0
        while not self.over.is_set():
            turn += 1
            key = f"of {self.name}, {turn % 5}"
            began = time.monotonic()
            try:
                if turn % 7 == 0 and self.cluster.known[key].possible != [None]:
                    self.cluster.delete(self.name, key)
                else:
                    self.cluster.write(self.name, key, wait=turn % 3 == 0)
                self.acknowledged += 1
                self.longest = max(self.longest, time.monotonic() - self.last)
                self.last = time.monotonic()
            except grpc.RpcError as error:
                if reason(error) == "not_found":
                    continue  # one that was or was not stored
                self.refused.append((error.code(), reason(error), error.details(), time.monotonic() - began))
            time.sleep(0.05)

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self.over.set()
        self.thread.join()


class Link:
    """A port that leads to an address (a Unix socket's path, or a host and a port), until it is cut: then nothing
    comes through any more, and nobody is told."""

    def __init__(self, target):
        self.target = target
        self.open = threading.Event()
        self.open.set()
        self.over = False
        self.listener = socket.create_server(("127.0.0.1", 0))
        self.port = self.listener.getsockname()[1]
        self.thread = threading.Thread(target=self.accept, daemon=True)
        self.thread.start()

    def cut(self):
        self.open.clear()

    def mend(self):
        self.open.set()

    def accept(self):
        while True:
            try:
                near, _ = self.listener.accept()
            except OSError:
                return
            threading.Thread(target=self.carry, args=(near,), daemon=True).start()

    def carry(self, near):
        self.open.wait()
        with near:
            try:
                far = socket.socket(socket.AF_UNIX if isinstance(self.target, str) else socket.AF_INET)
                with far:
                    far.connect(self.target)
                    self.forward(near, far)
            except OSError:
                pass

    def forward(self, near, far):
        others = {near: far, far: near}
        while not self.over:
            for ready in select.select([near, far], [], [], 0.5)[0]:
                self.open.wait()
                data = ready.recv(65_536)
                self.open.wait()
                if not data:
                    return
                others[ready].sendall(data)

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self.over = True
        self.open.set()
        # A thread that is in accept would not notice that it is closed.
        self.listener.shutdown(socket.SHUT_RDWR)
        self.listener.close()
        self.thread.join()


def free_address():
    """Host and port. The host is one of this machine's that no other test listens at: the port is still free when a
    server is started there."""
    host = "127." + ".".join(str(random.randrange(1, 255)) for _ in range(3))
    with socket.create_server((host, 0)) as listener:
        return listener.getsockname()


def seconds_until(condition, most):
    """How long it took, or None."""
    began = time.monotonic()
    return time.monotonic() - began if eventually(condition, most) else None
