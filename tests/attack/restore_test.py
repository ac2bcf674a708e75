# SPDX-License-Identifier: GPL-3.0-or-later
"""Backups and exports that somebody edited: what no client could have stored does not come in with them."""

import contextlib
import hashlib
import os
import sqlite3
import tempfile
import unittest

from attacker import MIB, Server, admin, ball, collections, grpc, main, reason, shapes

NEAR = 2**62 - 1_000
# What is changed, and what the error names: table, row and value.
ATTACKS = {
    "UPDATE collection SET name = '../x'": ("table collection, row 1", "'../x'"),
    "UPDATE collection SET name = 'a' || char(10)": ("table collection, row 1", "'a\\u000a'"),
    "UPDATE collection SET parameters = '{}'": ("table collection, row 1", "'{}'"),
    "UPDATE collection SET description = printf('%01025d', 0)": ("table collection, row 1", "1025 bytes"),
    "UPDATE shape_metadata SET name = 'a' || char(27)": ("table shape_metadata, row 1", "'a\\u001b'"),
    "UPDATE shape SET key = 'a' || char(155) || '2J'": ("table shape, row 1", "'a\\u009b2J'"),
    "UPDATE shape SET updated_at = -1": ("table shape, row 1", "'-1'"),
    f"UPDATE sqlite_sequence SET seq = {NEAR} WHERE name = 'shape'": ("table shape", str(NEAR)),
    f"UPDATE sqlite_sequence SET seq = {NEAR} WHERE name = 'job'": ("table job", str(NEAR)),
    "UPDATE shape SET key = 'a' || char(917505)": ("table shape, row 1", "'a\\udb40\\udc01'"),
    "UPDATE shape SET origin_x = 1e12": ("shape 'ball': origin: coordinates up to 1e+12", "double precision"),
    "UPDATE shape SET origin_y = 1e38": ("shape 'ball': origin: coordinates up to 1e+38", "double precision"),
    f"UPDATE shape SET version = {NEAR}": ("table shape, row 1", str(NEAR)),
}


def chunks(content):
    for first in range(0, len(content), MIB):
        yield admin.BackupChunk(total_bytes=len(content) if first == 0 else 0, data=content[first:first + MIB])
    yield admin.BackupChunk(sha256=hashlib.sha256(content).digest())


def edited(content, sql):
    with tempfile.TemporaryDirectory() as folder:
        path = folder + "/edited"
        with open(path, "wb") as file:
            file.write(content)
        with contextlib.closing(sqlite3.connect(path)) as database:
            database.execute(sql)
            database.commit()
        with open(path, "rb") as file:
            return file.read()


class Edited(unittest.TestCase):
    def state(self, client):
        listed = client.collections.ListCollections(collections.ListCollectionsRequest(), timeout=10).collections
        return [(one.name, one.shapes) for one in listed]

    def refused(self, call, words):
        with self.assertRaises(grpc.RpcError) as error:
            call()
        self.assertEqual(reason(error.exception), "malformed_file", error.exception)
        for word in words:
            self.assertIn(word, error.exception.details())

    def test_files_are_refused_with_table_row_and_value(self):
        with Server() as server, server.connect() as client:
            client.add("ball", ball(300), metadata={"label": "ball"})
            backup = b"".join(chunk.data for chunk in client.admin.Backup(admin.BackupRequest(), timeout=60))
            export = b"".join(chunk.data for chunk in client.admin.ExportCollection(
                admin.ExportCollectionRequest(collection="default"), timeout=60))
            before = self.state(client)

            def imported(content):
                header = admin.ImportCollectionHeader(collection="copy")
                yield admin.ImportCollectionRequest(header=header)
                for chunk in chunks(content):
                    yield admin.ImportCollectionRequest(chunk=chunk)

            for sql, words in ATTACKS.items():
                with self.subTest(sql=sql):
                    self.refused(lambda: client.admin.Restore(chunks(edited(backup, sql)), timeout=60), words)
                    self.refused(lambda: client.admin.ImportCollection(imported(edited(export, sql)), timeout=60), words)
                    self.assertEqual(self.state(client), before)
            self.assertEqual(os.listdir(server.data + "/tmp"), [])
            client.admin.Restore(chunks(backup), timeout=60)
            client.admin.ImportCollection(imported(export), timeout=60)
            client.add("more", ball(300))

    def test_an_export_does_not_take_the_place_of_everything(self):
        with Server() as server, server.connect() as client:
            client.add("ball", ball(300))
            client.collections.CreateCollection(collections.CreateCollectionRequest(name="other"), timeout=10)
            export = list(client.admin.ExportCollection(admin.ExportCollectionRequest(collection="default"), timeout=60))
            before = self.state(client)
            self.refused(lambda: client.admin.Restore(iter(export), timeout=60),
                         ["export of one collection, 'default'", "shapedb collection import"])
            self.assertEqual(self.state(client), before)

    def test_databases_are_told_by_the_check(self):
        with Server() as server:
            with server.connect() as client:
                client.add("ball", ball(300), metadata={"label": "ball"})
            self.assertEqual(server.stop(), 0)
            path = server.data + "/shapedb.sqlite"
            with open(path, "rb") as file:
                whole = file.read()
            for sql, words in ATTACKS.items():
                with self.subTest(sql=sql):
                    with open(path, "wb") as file:
                        file.write(edited(whole, sql))
                    server.start()
                    with server.connect() as client:
                        found = [p for m in client.admin.Check(admin.CheckRequest(), timeout=60) for p in m.problems]
                    self.assertEqual(server.stop(), 0)
                    self.assertTrue(any(all(word in problem for word in words) for problem in found), found)


class Deletions(unittest.TestCase):
    def test_are_recognised_when_they_are_repeated(self):
        with Server() as server:
            request = shapes.DeleteShapeRequest(shape=shapes.ShapeRef(key="ball"), expected_version=1)
            with server.connect() as client:
                client.add("ball", ball(300), metadata={"label": "ball"})
                first = client.shapes.DeleteShape(request, timeout=10)
                again = client.shapes.DeleteShape(request, timeout=10)
                self.assertEqual(again.shape.key, "ball")
                self.assertEqual(dict(again.shape.metadata), {"label": "ball"})
                self.assertEqual(again.shape.version, first.shape.version)
            server.process.kill()
            server.process.wait()
            server.process.stdout.close()
            server.start()
            with server.connect() as client:
                client.shapes.DeleteShape(request, timeout=10)
                request.expected_version = 2
                with self.assertRaises(grpc.RpcError) as error:
                    client.shapes.DeleteShape(request, timeout=10)
                self.assertEqual(error.exception.code(), grpc.StatusCode.NOT_FOUND)


if __name__ == "__main__":
    main()
