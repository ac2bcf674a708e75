# SPDX-License-Identifier: GPL-3.0-or-later
"""A mixed load for a long time: memory, descriptors, threads, the log of the database and temporary files stay flat.

SHAPEDB_TEST_SCALE multiplies the 15 seconds: 240 is an hour. SHAPEDB_TEST_SEED chooses other calls.
"""

import os
import random
import threading
import time
import unittest

from attacker import MIB, Server, admin, ball, eventually, grpc, main, pack, search, shapes, types

# Taken away, since the server refuses variables of this kind that it does not know.
SCALE = max(1, int(os.environ.pop("SHAPEDB_TEST_SCALE", "1")))
SEED = int(os.environ.pop("SHAPEDB_TEST_SEED", "1"))
SECONDS = 15 * SCALE
CLIENTS = 4
PAUSE = 0.02  # leaves the machine to others
KEYS = 200
CLOUDS = [ball(200 * (i + 1), 1 + 0.1 * i) for i in range(10)]
CHUNKS = [types.PointChunk(xyz=pack(cloud)) for cloud in CLOUDS]
# Everybody's calls may collide with everybody's.
EXPECTED = (grpc.StatusCode.NOT_FOUND, grpc.StatusCode.FAILED_PRECONDITION, grpc.StatusCode.ALREADY_EXISTS,
            grpc.StatusCode.ABORTED, grpc.StatusCode.RESOURCE_EXHAUSTED)


def options(**more):
    return search.SearchOptions(collection="default", k=10, **more)


class Load:
    """Clients that make all kinds of calls until they are stopped."""

    def __init__(self, server):
        self.server = server
        self.calls = {}
        self.unexpected = []
        self.stop = threading.Event()
        self.lock = threading.Lock()
        dice = random.Random(SEED)
        self.threads = [threading.Thread(target=self.run, args=(random.Random(dice.random()), self.everyday()))
                        for _ in range(CLIENTS)]
        self.threads.append(threading.Thread(target=self.run, args=(random.Random(SEED), self.heavy())))

    def everyday(self):
        return ([self.add] * 4 + [self.abandon, self.delete, self.patch, self.list, self.points, self.by_key, self.by_key,
                                  self.batch, self.by_scan, self.hurry])

    def heavy(self):
        return [self.rebuild, self.backup, self.export, self.check]

    def run(self, dice, kinds):
        while not self.stop.is_set():
            # A connection of its own for a while.
            with self.server.connect() as client:
                for _ in range(50):
                    if self.stop.wait(PAUSE * len(kinds) / 14 if len(kinds) > 4 else 1):
                        return
                    self.call(dice.choice(kinds), client, dice)

    def call(self, kind, client, dice):
        try:
            kind(client, dice)
        except grpc.RpcError as error:
            if error.code() not in EXPECTED:
                self.unexpected.append(f"{kind.__name__}: {error.code()}: {error.details()}")
        with self.lock:
            self.calls[kind.__name__] = self.calls.get(kind.__name__, 0) + 1

    def key(self, dice):
        return f"k{dice.randrange(KEYS)}"

    def ref(self, dice):
        return shapes.ShapeRef(key=self.key(dice))

    def upload(self, dice):
        chunk = dice.choice(CHUNKS)
        yield shapes.AddShapeRequest(
            header=shapes.AddShapeHeader(key=self.key(dice), point_count=len(chunk.xyz) // 12, wait=dice.random() < 0.3,
                                         metadata={"kind": str(dice.randrange(5))}))
        yield shapes.AddShapeRequest(chunk=chunk)

    def add(self, client, dice):
        client.shapes.AddShape(self.upload(dice), timeout=60)

    def abandon(self, client, dice):
        """Half an upload."""
        sent = threading.Event()

        def half():
            yield next(self.upload(dice))
            sent.set()
            self.stop.wait(5)

        call = client.shapes.AddShape.future(half(), timeout=30)
        sent.wait(5)
        call.cancel()

    def delete(self, client, dice):
        client.shapes.DeleteShape(shapes.DeleteShapeRequest(shape=self.ref(dice)), timeout=30)

    def patch(self, client, dice):
        client.shapes.UpdateMetadata(
            shapes.UpdateMetadataRequest(key=self.key(dice),
                                         change=shapes.MetadataChange(set={"seen": str(dice.randrange(1000))})),
            timeout=30)

    def list(self, client, dice):
        client.shapes.ListShapes(shapes.ListShapesRequest(page_size=50), timeout=30)

    def points(self, client, dice):
        for _ in client.shapes.GetPoints(shapes.GetPointsRequest(shape=self.ref(dice)), timeout=30):
            pass

    def by_key(self, client, dice):
        client.search.SearchByKey(search.SearchByKeyRequest(options=options(), key=self.key(dice)), timeout=30)

    def batch(self, client, dice):
        queries = [search.SearchBatchRequest.Query(key=self.key(dice)) for _ in range(5)]
        client.search.SearchBatch(search.SearchBatchRequest(options=options(), queries=queries), timeout=120)

    def by_scan(self, client, dice):
        chunk = dice.choice(CHUNKS)
        header = search.SearchByScanHeader(options=options(), point_count=len(chunk.xyz) // 12)
        client.search.SearchByScan(iter([search.SearchByScanRequest(header=header),
                                         search.SearchByScanRequest(chunk=chunk)]), timeout=60)

    def hurry(self, client, dice):
        """A search without the time for it."""
        try:
            client.search.SearchByKey(search.SearchByKeyRequest(options=options(), key=self.key(dice)), timeout=0.002)
        except grpc.RpcError as error:
            if error.code() != grpc.StatusCode.DEADLINE_EXCEEDED:
                raise

    def rebuild(self, client, dice):
        request = admin.RebuildRequest(collection="default",
                                       signature=types.SignatureParameters(max_points=dice.choice([6, 7, 8])))
        try:
            for _ in client.admin.Rebuild(request, timeout=600):
                pass
        except grpc.RpcError as error:
            # Uploads come first; it goes on without its client.
            if error.code() != grpc.StatusCode.DEADLINE_EXCEEDED:
                raise

    def backup(self, client, dice):
        for _ in client.admin.Backup(admin.BackupRequest(), timeout=120):
            pass

    def export(self, client, dice):
        for _ in client.admin.ExportCollection(admin.ExportCollectionRequest(collection="default"), timeout=120):
            pass

    def check(self, client, dice):
        for part in client.admin.Check(admin.CheckRequest(), timeout=120):
            self.unexpected += part.problems


class Sample:
    def __init__(self, server):
        process = f"/proc/{server.process.pid}"
        self.memory = server.resident() / MIB
        self.descriptors = len(os.listdir(f"{process}/fd"))
        self.threads = len(os.listdir(f"{process}/task"))
        files = self.sizes(server.data)
        self.wal = sum(size for name, size in files.items() if name.endswith("-wal")) / MIB
        self.temporary = sum(self.sizes(os.path.join(server.data, "tmp")).values()) / MIB

    @staticmethod
    def sizes(folder):
        found = {}
        for entry in os.scandir(folder):
            try:
                found[entry.name] = entry.stat().st_size
            except FileNotFoundError:
                pass  # removed meanwhile
        return found


class Soak(unittest.TestCase):
    def test_leaves_the_server_as_it_was(self):
        with Server() as server:
            with server.connect() as client:
                for i, cloud in enumerate(CLOUDS):
                    client.add(f"k{i}", cloud)
            idle = Sample(server)
            load = Load(server)
            for thread in load.threads:
                thread.start()
            samples = []
            until = time.monotonic() + SECONDS
            while time.monotonic() < until:
                time.sleep(0.5)
                samples.append(Sample(server))
            load.stop.set()
            for thread in load.threads:
                thread.join()
            self.tell(load, samples)
            self.assertTrue(server.running(), server.log())
            self.assertEqual(load.unexpected[:5], [])
            # The first third fills caches and pools.
            third = len(samples) // 3
            before, after = samples[third:2 * third], samples[2 * third:]
            for name, slack in (("memory", 32), ("descriptors", 20), ("threads", 20), ("wal", 16)):
                grown = max(getattr(s, name) for s in after) - max(getattr(s, name) for s in before)
                self.assertLess(grown, slack, name)
            # Nothing is kept for clients that have gone.
            self.assertTrue(eventually(lambda: Sample(server).descriptors <= idle.descriptors + 2, 60),
                            f"{Sample(server).descriptors} descriptors, {idle.descriptors} before")
            self.assertTrue(eventually(lambda: Sample(server).temporary == 0), os.listdir(server.data + "/tmp"))

    def tell(self, load, samples):
        print(f"{SECONDS} s, {sum(load.calls.values())} calls: {dict(sorted(load.calls.items()))}")
        part = max(1, len(samples) // 6)
        print("most of each sixth: memory MiB, descriptors, threads, log MiB, temporary files MiB")
        for first in range(0, len(samples) - part + 1, part):
            some = samples[first:first + part]
            print("  " + "  ".join(f"{max(getattr(s, name) for s in some):7.1f}"
                                   for name in ("memory", "descriptors", "threads", "wal", "temporary")))


if __name__ == "__main__":
    main()
