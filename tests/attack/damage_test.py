# SPDX-License-Identifier: GPL-3.0-or-later
"""A leaf page of each table and index is overwritten: what can be served is served, and the rest says what helps."""

import contextlib
import functools
import hashlib
import shutil
import sqlite3
import tempfile
import time
import unittest

from attacker import MIB, Server, admin, ball, collections, eventually, grpc, main, reason, search, shapes, types

# Without it nothing can be told of the database: the start is refused.
ESSENTIAL = {"schema_migration", "sqlite_schema"}
COLLECTIONS = 40  # so many rows that their table has several leaves
# What searches read. One of their leaves holds rows of one of the two collections.
SEARCHED = {"shape", "shape_metadata", "signature"}
# What searches do without, for the tables have it too.
INDICES = {"sqlite_autoindex_shape_1", "sqlite_autoindex_signature_1", "shape_by_collection"}
# Of the small tables, checked when the server starts.
SMALL = {"sqlite_sequence", "tally", "collection", "collection_alias", "job", "rebuild", "rebuild_failure"}


def leaves(path):
    """The leaf pages of each table and index, with the table."""
    with contextlib.closing(sqlite3.connect(f"file:{path}?mode=ro", uri=True)) as database:
        tables = dict(database.execute("SELECT name, tbl_name FROM sqlite_schema"))
        found = {}
        for name, page in database.execute("SELECT name, pageno FROM dbstat WHERE pagetype = 'leaf' ORDER BY pageno"):
            found.setdefault((name, tables.get(name, name)), []).append(page)
    return found


def damage(path, page):
    with open(path, "r+b") as file:
        file.seek((page - 1) * 4096)
        file.write(b"\xff" * 64)


def find(client, collection, key="ball 1"):
    options = search.SearchOptions(collection=collection, k=3, verify=False)
    request = search.SearchByKeyRequest(options=options, key=key, include_self=True)
    return client.search.SearchByKey(request, timeout=30).hits[0].shape.key


def restored(path):
    with open(path, "rb") as file:
        content = file.read()
    for first in range(0, len(content), MIB):
        last = first + MIB >= len(content)
        yield admin.BackupChunk(total_bytes=len(content) if first == 0 else 0, data=content[first:first + MIB],
                                sha256=hashlib.sha256(content).digest() if last else b"")


class Damage(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory(prefix="shapedb-damage-")
        cls.addClassCleanup(cls.folder.cleanup)
        cls.whole = cls.folder.name + "/whole"
        cls.backup = cls.folder.name + "/backup"
        with Server(directory=cls.whole) as server:
            with server.connect() as client:
                cls.fill(client)
                with open(cls.backup, "wb") as file:
                    for chunk in client.admin.Backup(admin.BackupRequest(), timeout=300):
                        file.write(chunk.data)
                for i in range(3):  # some are pending when it stops
                    client.add(f"big {i}", ball(20_000, 1 + i), collection="second", wait=False)
            assert server.stop() == 0

    @classmethod
    def fill(cls, client):
        for name in ["first", "second", *(f"more-{i}" for i in range(COLLECTIONS))]:
            client.collections.CreateCollection(
                collections.CreateCollectionRequest(name=name, description="x" * 200, profile=types.PROFILE_PAPER),
                timeout=60)
            client.collections.SetAlias(collections.SetAliasRequest(alias=f"{name}-alias", collection=name), timeout=10)
        for name in ("first", "second"):
            for i in range(60):
                client.add(f"ball {i}", ball(100, 1 + 0.05 * i), collection=name, wait=False,
                           metadata={"note": "n" * 100})
        assert eventually(lambda: client.admin.Stats(admin.StatsRequest(), timeout=10).shapes_pending == 0, 300)
        for _ in client.admin.Rebuild(admin.RebuildRequest(collection="first"), timeout=300):
            pass

    @contextlib.contextmanager
    def server(self, prepare):
        with tempfile.TemporaryDirectory(prefix="shapedb-damaged-") as folder:
            data = folder + "/data"
            shutil.copytree(self.whole, data)
            prepare(data + "/shapedb.sqlite")
            with Server(directory=data) as server:
                yield server

    def served(self, client):
        """Those of the two collections that are searched; the other must say what helps."""
        good = []
        for name in ("first", "second"):
            try:
                self.assertEqual(find(client, name), "ball 1")
                good.append(name)
            except grpc.RpcError as error:
                self.assertEqual(reason(error), "data_loss", error)
                for word in ("in table ", "shapedb admin check", "restore"):
                    self.assertIn(word, error.details())
        return good

    def check(self, client):
        return [p for m in client.admin.Check(admin.CheckRequest(), timeout=60) for p in m.problems]

    def test_of_any_table_is_told_and_a_restore_mends_it(self):
        for (name, table), pages in leaves(self.whole + "/shapedb.sqlite").items():
            with self.subTest(name=name, table=table):
                # The first leaf of the table of collections has the two that are asked about.
                prepare = functools.partial(damage, page=pages[-2 if table == "collection" and len(pages) > 1 else 0])
                if table in ESSENTIAL:
                    with self.assertRaises(RuntimeError) as refused, self.server(prepare):
                        pass
                    for word in ("in table " + table, "data_loss", "move '", "'shapedb admin restore'"):
                        self.assertIn(word, str(refused.exception))
                else:
                    with self.server(prepare) as server:
                        self.one_leaf(server, name, table)

    def one_leaf(self, server, name, table):
        with server.connect() as client:
            good = self.served(client)
            if name not in SEARCHED:
                self.assertEqual(good, ["first", "second"])
            else:
                self.assertEqual(len(good), 1)
            if name in INDICES - {"sqlite_autoindex_shape_1"}:
                self.assertIn("an index of the database is damaged", server.log())
            self.assertTrue(client.serving())
            client.admin.ServerInfo(admin.ServerInfoRequest(), timeout=10)
            client.collections.ListCollections(collections.ListCollectionsRequest(), timeout=10)
            self.assertTrue(self.check(client))
            if table in SMALL:
                self.assertIn(f"table {table} is damaged", server.log())
            if name != table:
                self.mended_by_a_backup_made_now(client)
            client.admin.Restore(restored(self.backup), timeout=60)
            self.assertEqual(self.served(client), ["first", "second"], "after the restore")
            client.add("after", ball(300), collection="second-alias", wait=False)
            self.assertEqual(self.check(client), [])

    def mended_by_a_backup_made_now(self, client):
        now = self.folder.name + "/now"
        with open(now, "wb") as file:
            for chunk in client.admin.Backup(admin.BackupRequest(), timeout=60):
                file.write(chunk.data)
        client.admin.Restore(restored(now), timeout=60)
        self.assertEqual(self.check(client), [])
        # Nothing is lost, not even what came after the other backup.
        for i in range(3):
            ref = shapes.ShapeRef(collection="second", key=f"big {i}")
            client.shapes.GetShape(shapes.GetShapeRequest(shape=ref), timeout=10)
        self.assertEqual(self.served(client), ["first", "second"])

    def test_of_the_collections_is_told_by_name(self):
        pages = leaves(self.whole + "/shapedb.sqlite")[("collection", "collection")]
        self.assertGreater(len(pages), 2)
        with self.server(lambda path: damage(path, pages[-2])) as server, server.connect() as client:
            self.assertEqual(self.served(client), ["first", "second"])
            listed = client.collections.ListCollections(collections.ListCollectionsRequest(), timeout=10).collections
            self.assertEqual(len(listed), COLLECTIONS + 3)
            lost = [one for one in listed if one.damage]
            self.assertTrue(0 < len(lost) < COLLECTIONS)
            for one in lost:
                self.assertRegex(one.name, "^more-")
                for word in (f"'{one.name}'", "row in table collection", "restore a backup"):
                    self.assertIn(word, one.damage)
                self.assertFalse(one.HasField("segmentation"))
            with self.assertRaises(grpc.RpcError) as error:
                client.add("x", ball(300), collection=lost[0].name + "-alias")
            self.assertEqual(reason(error.exception), "data_loss")
            client.add("x", ball(300), collection="first")

    def test_of_the_queue_stops_no_search_and_is_told_to_who_uploads(self):
        pages = leaves(self.whole + "/shapedb.sqlite")[("job", "job")]
        with self.server(lambda path: damage(path, pages[0])) as server, server.connect() as client:
            self.assertEqual(self.served(client), ["first", "second"])
            pending = shapes.WatchIngestRequest(shape=shapes.ShapeRef(collection="second", key="big 2"))
            for attempt in (lambda: client.add("x", ball(300), collection="first"),
                            lambda: list(client.shapes.WatchIngest(pending, timeout=30))):
                with self.assertRaises(grpc.RpcError) as error:
                    attempt()
                self.assertEqual(reason(error.exception), "data_loss")
                for word in ("no scan is taken in", "table job", "shapedb admin check", "shapedb admin restore"):
                    self.assertIn(word, error.exception.details())
            log = server.log()
            time.sleep(2)
            self.assertEqual(server.log(), log, "it does not complain again and again")

    def test_of_the_parameters_takes_out_one_collection_until_it_gets_new_ones(self):
        def prepare(path):
            with contextlib.closing(sqlite3.connect(path)) as database:
                database.execute("UPDATE collection SET parameters = '{\"profile' WHERE name = 'first'")
                database.commit()

        with self.server(prepare) as server, server.connect() as client:
            words = ("'first'", "parameters", "shapedb admin rebuild --profile default --collection first")
            ball_1 = shapes.ShapeRef(collection="first", key="ball 1")
            other = shapes.ShapeRef(collection="second", key="ball 1")
            for attempt in (lambda: find(client, "first"),
                            lambda: client.add("x", ball(300), collection="first"),
                            lambda: client.search.Compare(search.CompareRequest(query=ball_1, other=other), timeout=30),
                            lambda: client.shapes.GetSegments(shapes.GetSegmentsRequest(shape=ball_1), timeout=30),
                            lambda: list(client.admin.Rebuild(admin.RebuildRequest(collection="first"), timeout=30)),
                            lambda: list(client.admin.ExportCollection(
                                admin.ExportCollectionRequest(collection="first"), timeout=30))):
                with self.assertRaises(grpc.RpcError) as error:
                    result = attempt()
                    if hasattr(result, "__next__"):
                        list(result)
                self.assertEqual(reason(error.exception), "data_loss", error.exception)
                for word in words:
                    self.assertIn(word, error.exception.details())
            self.assertEqual(find(client, "second"), "ball 1")
            shown = client.collections.GetCollection(collections.GetCollectionRequest(name="first"), timeout=10)
            self.assertEqual((shown.shapes, shown.HasField("segmentation")), (60, False))
            self.assertTrue(any("'first'" in problem for problem in self.check(client)))
            for _ in client.admin.Rebuild(
                    admin.RebuildRequest(collection="first", profile=types.PROFILE_PAPER), timeout=300):
                pass
            self.assertEqual(find(client, "first"), "ball 1")
            self.assertEqual(self.check(client), [])
            client.add("x", ball(300), collection="first")


class DamagedKeys(unittest.TestCase):
    def test_refuse_the_start_and_say_what_helps(self):
        with Server(first_key=True) as server:
            server.stop()
            path = server.data + "/keys.sqlite"
            with open(path, "rb") as file:
                whole = file.read()
            for name, pages in leaves(path).items():
                if name[0] not in ("schema_migration", "api_key", "api_key_usage"):
                    continue
                with open(path, "wb") as file:
                    file.write(whole)
                damage(path, pages[0])
                with self.assertRaises(RuntimeError) as refused:
                    server.start()
                for word in (f"in table {name[0]};", f"move '{path}' away", "shapedbd key create"):
                    self.assertIn(word, str(refused.exception))
            with open(path, "wb") as file:
                file.write(whole)
            server.start()


if __name__ == "__main__":
    main()
