# SPDX-License-Identifier: GPL-3.0-or-later
"""What grpc.health.v1 says of each service when something is out of order, as docs/operations.md has it."""

import contextlib
import hashlib
import os
import resource
import socket
import sqlite3
import threading
import unittest

import health_pb2

from attacker import MIB, SecuredServer, Server, admin, ball, collections, eventually, grpc, main, reason

SERVER = ["", "shapedb.v1.ShapeService", "shapedb.v1.SearchService", "shapedb.v1.CollectionService",
          "shapedb.v1.AlignService"]
ADMIN = "shapedb.v1.AdminService"
SEGMENTATION = "shapedb.segmentation"
STORAGE = "shapedb.storage"
ALL = [*SERVER, ADMIN, SEGMENTATION, STORAGE]


def serving(client):
    return [name for name in ALL if client.serving(name)]


@contextlib.contextmanager
def edited(server):
    """The database of a server that was stopped."""
    assert server.stop() == 0
    with contextlib.closing(sqlite3.connect(server.data + "/shapedb.sqlite")) as database:
        yield database
        database.commit()


class Health(unittest.TestCase):
    def test_knows_these_names_and_no_other(self):
        with Server() as server, server.connect() as client:
            self.assertEqual(serving(client), ALL)
            for name in ("shapedb", "shapedb.v1", "default", "shapedb.segmentation/default"):
                with self.assertRaises(grpc.RpcError) as error:
                    client.serving(name)
                self.assertEqual(error.exception.code(), grpc.StatusCode.NOT_FOUND)

    def test_of_a_server_with_one_damaged_collection_is_good(self):
        with Server() as server:
            with edited(server) as database:
                database.execute("UPDATE collection SET parameters = 'none'")
            server.start()
            with server.connect() as client:
                self.assertEqual(serving(client), ALL)
                listed = client.collections.ListCollections(collections.ListCollectionsRequest(), timeout=10)
                self.assertTrue(listed.collections[0].damage)

    def test_of_a_damaged_queue_is_told_apart_and_mended_by_a_restore(self):
        with Server() as server:
            with server.connect() as client:
                client.add("ball", ball(300))
                backup = b"".join(chunk.data for chunk in client.admin.Backup(admin.BackupRequest(), timeout=60))
            with edited(server) as database:
                page, = database.execute("SELECT rootpage FROM sqlite_schema WHERE name = 'job'").fetchone()
            with open(server.data + "/shapedb.sqlite", "r+b") as file:
                file.seek((page - 1) * 4096)
                file.write(b"\xff" * 64)
            server.start()
            with server.connect() as client:
                self.assertTrue(eventually(lambda: not client.serving(SEGMENTATION), 10))
                self.assertEqual(serving(client), [*SERVER, ADMIN, STORAGE])
                with self.assertRaises(grpc.RpcError) as error:
                    client.add("more", ball(300))
                self.assertEqual(reason(error.exception), "data_loss")
                self.restore(client, backup)
                self.assertTrue(eventually(lambda: serving(client) == ALL, 10))
                client.add("more", ball(300))

    def test_of_lost_changes_is_told_until_they_are_acknowledged(self):
        with Server() as server:
            with server.connect() as client:
                client.add("ball", ball(300))
            for how in ("log", "log and mark"):
                server.process.kill()  # what was acknowledged is in the log alone
                server.process.wait()
                server.process.stdout.close()
                os.truncate(server.data + "/shapedb.sqlite-wal", 0)
                if how == "log and mark":
                    os.truncate(server.data + "/shapedb.sqlite.commits", 0)
                for start in range(3):
                    if start > 0:
                        server.start()
                        self.assertIn("shapedb admin check --acknowledge", server.log())
                        with server.connect() as client:
                            self.assertEqual(serving(client), [*SERVER, ADMIN, SEGMENTATION], how)
                            self.assertEqual(len(self.check(client)), 1)
                            missing = client.admin.Stats(admin.StatsRequest(), timeout=10).missing_commits
                            self.assertEqual(missing > 0, how == "log")
                        self.assertEqual(server.stop(), 0)
                server.start()
                with server.connect() as client:
                    self.assertEqual(len(self.check(client, acknowledge=True)), 1)
                    self.assertTrue(eventually(lambda: serving(client) == ALL, 10))
                    self.assertEqual(self.check(client), [])
                self.assertEqual(server.stop(), 0)  # the acknowledgement is not in the log that is lost next
                server.start()
                with server.connect() as client:
                    client.add("ball", ball(300, 2.0))

    def check(self, client, **options):
        return [p for m in client.admin.Check(admin.CheckRequest(**options), timeout=60) for p in m.problems]

    def restore(self, client, backup):
        client.admin.Restore(iter([
            *(admin.BackupChunk(total_bytes=len(backup) if i == 0 else 0, data=backup[i:i + MIB])
              for i in range(0, len(backup), MIB)),
            admin.BackupChunk(sha256=hashlib.sha256(backup).digest())]), timeout=60)

    def test_with_a_dead_listener_is_bad_until_it_is_back(self):
        with SecuredServer() as server, server.local() as client:
            self.assertEqual(serving(client), ALL)
            before = resource.prlimit(server.process.pid, resource.RLIMIT_NOFILE)
            resource.prlimit(server.process.pid, resource.RLIMIT_NOFILE, (8, before[1]))
            with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", server.port), timeout=5):
                pass
            self.assertTrue(eventually(lambda: serving(client) == [], 10), server.log())
            self.assertIn("connections cannot be accepted", server.log())
            resource.prlimit(server.process.pid, resource.RLIMIT_NOFILE, before)
            self.assertTrue(eventually(lambda: serving(client) == ALL, 30), server.log())
            self.assertIn("connections are accepted again", server.log())

    def test_with_a_dead_listener_of_http_is_bad_until_it_is_back(self):
        with SecuredServer("--http-listen", "127.0.0.1:0") as server, server.local() as client:
            self.assertEqual(serving(client), ALL)  # and its connection is open
            before = resource.prlimit(server.process.pid, resource.RLIMIT_NOFILE)
            resource.prlimit(server.process.pid, resource.RLIMIT_NOFILE, (8, before[1]))
            with contextlib.suppress(OSError), socket.create_connection(("127.0.0.1", server.http_port), timeout=5):
                self.assertTrue(eventually(lambda: serving(client) == [], 30), server.log())
            self.assertIn("HTTP connections cannot be accepted", server.log())
            resource.prlimit(server.process.pid, resource.RLIMIT_NOFILE, before)
            self.assertTrue(eventually(lambda: serving(client) == ALL, 30), server.log())
            self.assertIn("HTTP connections are accepted again", server.log())

    def test_watchers_see_the_end_of_each_service(self):
        with Server("--shutdown-drain-seconds", "2") as server, server.connect() as client:
            seen = {}

            def watch(name):
                with contextlib.suppress(grpc.RpcError):
                    for reply in client.health.Watch(health_pb2.HealthCheckRequest(service=name), timeout=30):
                        seen.setdefault(name, []).append(reply.status)

            threads = [threading.Thread(target=watch, args=(name,)) for name in ALL]
            for thread in threads:
                thread.start()
            self.assertTrue(eventually(lambda: len(seen) == len(ALL), 20))
            server.stop()
            for thread in threads:
                thread.join()
            for name in ALL:
                self.assertEqual(seen[name], [health_pb2.HealthCheckResponse.SERVING,
                                              health_pb2.HealthCheckResponse.NOT_SERVING], name)


if __name__ == "__main__":
    main()
