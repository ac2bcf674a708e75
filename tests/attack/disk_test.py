# SPDX-License-Identifier: GPL-3.0-or-later
"""Attacks on the disk and on what is kept there."""

import contextlib
import os
import random
import subprocess
import tempfile
import threading
import time
import unittest

from attacker import MIB, Server, admin, ball, collections, eventually, grpc, main, reason, run_together, search, shapes


class DataDirectory(unittest.TestCase):
    def test_of_others_is_refused_and_left_alone(self):
        with tempfile.TemporaryDirectory() as directory:
            os.makedirs(directory + "/tmp/photos")
            with self.assertRaisesRegex(RuntimeError, "no ShapeDB database"):
                Server(directory=directory)
            self.assertTrue(os.path.isdir(directory + "/tmp/photos"))
            self.assertEqual(os.listdir(directory), ["tmp"])

    def test_links_in_it_are_not_followed(self):
        with tempfile.TemporaryDirectory() as elsewhere:
            os.makedirs(elsewhere + "/shapedb-AbCdEf")
            open(elsewhere + "/shapedb-AbCdEf/database", "w").close()
            with Server() as server:
                server.stop()
                os.rmdir(server.data + "/tmp")
                os.symlink(elsewhere, server.data + "/tmp")
                with self.assertRaisesRegex(RuntimeError, "is a link"):
                    server.start()
                self.assertTrue(os.path.exists(elsewhere + "/shapedb-AbCdEf/database"))
                os.unlink(server.data + "/tmp")
                server.start()

    def test_nobody_else_can_read_what_the_server_writes(self):
        with Server() as server, server.connect() as client:
            client.add("ball", ball())
            list(client.admin.Rebuild(admin.RebuildRequest(collection="default"), timeout=60))
            for name in os.listdir(server.data):
                mode = os.stat(os.path.join(server.data, name)).st_mode & 0o077
                self.assertEqual(mode, 0, name)


class Copies(unittest.TestCase):
    def test_unread_backups_do_not_pile_up(self):
        with Server() as server, server.connect() as client:
            for i in range(20):
                client.add(f"ball {i}", ball(20_000, 1 + i), wait=False)
            self.assertTrue(eventually(lambda: client.admin.Stats(admin.StatsRequest()).shapes_pending == 0, 300))
            clients = [server.connect() for _ in range(8)]
            # Increments hold a copy as whole backups do.
            since = admin.BackupManifest(bytes=4096, sha256=bytes(32), block_bytes=4096, block_hashes=bytes(32))
            requests = [admin.BackupRequest(), admin.BackupRequest(since=since)]
            streams = [other.admin.Backup(requests[i % 2], timeout=60) for i, other in enumerate(clients)]
            outcomes = []

            def first(stream):
                try:
                    outcomes.append(next(stream) and None)
                except grpc.RpcError as error:
                    outcomes.append(error)

            threads = [threading.Thread(target=first, args=(stream,)) for stream in streams]
            run_together(threads)
            refused = [error for error in outcomes if error is not None]
            self.assertGreaterEqual(len(refused), 1)
            for error in refused:
                self.assertEqual(error.code(), grpc.StatusCode.RESOURCE_EXHAUSTED)
                self.assertEqual(reason(error), "queue_full")
            self.assertLessEqual(len(os.listdir(server.data + "/tmp")), 1)
            for other in clients:
                other.channel.close()
            self.assertTrue(eventually(lambda: not os.listdir(server.data + "/tmp")), "copies are left")
            received = sum(len(chunk.data) for chunk in client.admin.Backup(admin.BackupRequest(), timeout=60))
            self.assertGreater(received, 0, "the place is free again")

    def test_a_restore_that_announces_a_terabyte_is_refused_at_once(self):
        with Server() as server, server.connect() as client:
            def announce():
                yield admin.BackupChunk(total_bytes=1 << 42, data=b"x" * MIB)
                time.sleep(5)

            began = time.monotonic()
            with self.assertRaises(grpc.RpcError) as failure:
                client.admin.Restore(announce(), timeout=30)
            self.assertEqual(reason(failure.exception), "storage_full")
            self.assertLess(time.monotonic() - began, 4)
            self.assertEqual(os.listdir(server.data + "/tmp"), [])


class FileSizes(unittest.TestCase):
    def test_beyond_their_limit_end_an_upload_and_not_the_server(self):
        with Server(file_size=6 * MIB) as server, server.connect() as client:
            failure = None
            for i in range(60):
                try:
                    client.add(f"ball {i}", ball(40_000, 1 + 0.1 * i), wait=False)
                except grpc.RpcError as error:
                    failure = error
                    break
            self.assertIsNotNone(failure, "the limit was not reached")
            self.assertIn(reason(failure), ("storage_full", "storage"))
            self.assertTrue(server.running(), server.log())
            self.assertGreater(client.count(), 0)


class Keys(unittest.TestCase):
    def test_that_would_act_on_a_terminal_are_refused(self):
        attacks = [chr(c) for c in [*range(0x20), *range(0x7f, 0xa0)]]
        attacks += ["\u061c", "\u200e", "\u200f", "\u2028", "\u2029", "\u202e", "\u2066", "\u2069", "\ufeff"]
        attacks += ["\u200c", "\u200d", "\u034f", "\u115f", "\u3164", "\ufe0f", "\U000e0001", "\U000e0020", "\U000e007f"]
        with Server() as server, server.connect() as client:
            for attack in attacks:
                with self.assertRaises(grpc.RpcError) as failure:
                    client.add(f"evil{attack}[2Jkey", ball(100), wait=False)
                self.assertEqual(reason(failure.exception), "invalid_argument", repr(attack))
            log = server.log()
            for attack in attacks:
                if attack != "\n":
                    self.assertNotIn(attack, log, repr(attack))
            self.assertNotIn("\n[2J", log)
            self.assertIn("\\u202e", log)
            self.assertIn("\\udb40\\udc01", log)
            # Values may hold anything; what shows them escapes it.
            client.add("good", ball(500), metadata={"note": "\x1b[2J\r\nnext \u202e"})
            self.assertEqual(client.count(), 1)


class DamagedPage(unittest.TestCase):
    """One page of the database is overwritten: what can be served is served."""

    PAGE = 4096

    def page_of_signature(self, path, mine, others):
        """A page with signatures of one collection only."""
        with open(path, "rb") as file:
            content = file.read()
        pages = [{content.find(s) // self.PAGE for s in some} for some in (mine, others)]
        return min(pages[0] - pages[1])

    def test_takes_out_its_collection_and_no_other(self):
        with Server("--metrics-listen", "127.0.0.1:0") as server:
            with server.connect() as client:
                for name in ("first", "second"):
                    client.collections.CreateCollection(collections.CreateCollectionRequest(name=name), timeout=10)
                for i in range(40):
                    # No two signatures are the same: their bytes tell where they are.
                    client.add(f"ball {i}", ball(200, 1 + 0.05 * i), collection="first", wait=False)
                    if i < 4:
                        client.add(f"ball {i}", ball(200, 4 + 0.05 * i), collection="second", wait=False)
                self.assertTrue(eventually(lambda: client.admin.Stats(
                    admin.StatsRequest(), timeout=10).shapes_pending == 0, 300))

                def stored(name, count):
                    return [client.shapes.GetSignature(shapes.GetSignatureRequest(shape=shapes.ShapeRef(
                        collection=name, key=f"ball {i}")), timeout=10).signature.encoded for i in range(count)]
                signatures = stored("first", 40), stored("second", 4)
            self.assertEqual(server.stop(), 0)
            path = server.data + "/shapedb.sqlite"
            page = self.page_of_signature(path, *signatures)
            with open(path, "r+b") as file:
                file.seek(page * self.PAGE)
                file.write(b"\xff" * 64)
            server.start()
            with server.connect() as client:
                options = search.SearchOptions(collection="second", k=3, verify=False)
                found = client.search.SearchByKey(
                    search.SearchByKeyRequest(options=options, key="ball 1", include_self=True), timeout=30)
                self.assertEqual(found.hits[0].shape.key, "ball 1")
                options.collection = "first"
                with self.assertRaises(grpc.RpcError) as error:
                    client.search.SearchByKey(search.SearchByKeyRequest(options=options, key="ball 1"), timeout=30)
                self.assertEqual(reason(error.exception), "data_loss")
                for word in ("'first'", "shapedb admin check", "restore a backup"):
                    self.assertIn(word, error.exception.details())
                self.assertEqual(client.shapes.CountShapes(
                    shapes.CountShapesRequest(collection="first"), timeout=10).count, 40, "the shapes are there")
                problems = [p for m in client.admin.Check(admin.CheckRequest(), timeout=60) for p in m.problems]
                self.assertTrue(problems)
                client.add("more", ball(300), collection="second")
            self.assertIn("a collection is damaged", server.log())


class FullDisk(unittest.TestCase):
    """On a file system of 60 MiB in memory, which takes a mount namespace of our own."""

    NAMESPACE = ["unshare", "--user", "--map-root-user", "--mount"]

    @contextlib.contextmanager
    def server(self):
        if subprocess.run([*self.NAMESPACE, "mount", "-t", "tmpfs", "tmpfs", "/mnt"], capture_output=True).returncode:
            self.skipTest("this machine allows no mount namespace")
        with tempfile.TemporaryDirectory(prefix="shapedb-full-") as folder:
            inside = ("mount -t tmpfs -o size=60m tmpfs " + folder + " && exec \"$0\" \"$@\"")
            prefix = [*self.NAMESPACE, "sh", "-c", inside]
            with Server(directory=folder + "/data", prefix=prefix) as server, server.connect() as client:
                yield server, client

    def fill(self, client, collection="default", points=60_000, most=200):
        """Until nothing more goes in; the keys of what did."""
        stored, cloud = [], noise(points)
        while len(stored) < most:
            try:
                client.add(f"scan {len(stored)}", cloud, collection=collection, wait=False)
                stored.append(f"scan {len(stored)}")
            except grpc.RpcError as failure:
                self.assertEqual(reason(failure), "storage_full")
                return stored
        self.fail("the disk does not become full")

    def test_deletions_are_possible_and_make_room(self):
        with self.server() as (server, client):
            stored = self.fill(client)
            self.assertGreater(len(stored), 5)
            for key in stored:
                client.shapes.DeleteShape(shapes.DeleteShapeRequest(shape=shapes.ShapeRef(key=key)), timeout=30)
            self.assertEqual(client.count(), 0)
            self.assertTrue(server.running())
            self.assertEqual(list(client.admin.Check(admin.CheckRequest(), timeout=60))[-1].finished, True)
            # The space of what was deleted is used again.
            again = self.fill(client)
            self.assertGreater(len(again), len(stored) // 2)

    def test_a_large_collection_can_be_deleted_and_its_space_used_again(self):
        with self.server() as (server, client):
            client.collections.CreateCollection(collections.CreateCollectionRequest(name="many"), timeout=30)
            # On pages with those of another collection, which have to be written: more than the reserve.
            small = noise(170)
            for i in range(4_500):
                for collection in ("many", "default"):
                    client.add(f"small {i}", small, collection=collection, wait=False)
            stored = self.fill(client, "many")
            self.assertGreater(len(stored), 5)
            for _ in range(3):
                client.collections.DeleteCollection(
                    collections.DeleteCollectionRequest(name="many", force=True), timeout=120)
                names = [one.name for one in client.collections.ListCollections(
                    collections.ListCollectionsRequest(), timeout=10).collections]
                self.assertEqual(names, ["default"])
                client.collections.CreateCollection(collections.CreateCollectionRequest(name="many"), timeout=30)
                # Less than before: the others have been segmented meanwhile.
                self.assertGreater(len(self.fill(client, "many")), 5)
            self.assertEqual(client.count(), 4_500)
            self.assertEqual([p for m in client.admin.Check(admin.CheckRequest(), timeout=60) for p in m.problems], [])


def noise(points):
    """Points that hardly compress."""
    generator = random.Random(1)
    return [(generator.random(), generator.random(), generator.random()) for _ in range(points)]


if __name__ == "__main__":
    main()
