# SPDX-License-Identifier: GPL-3.0-or-later
"""Who may do what: TLS, API keys, roles, collections, limits; and that no secret is told anywhere."""

import datetime
import glob
import json
import os
import subprocess
import threading
import time
import unittest

from attacker import (SecuredServer, Server, admin, ball, collections, eventually, grpc, main, pack, reason, shapes,
                      types, upload)
from google.protobuf import timestamp_pb2
from rpcs import ADMIN, COLLECTION, READER, RULES, WHOLE_SERVER, WRITER, call, methods


def bearer(key):
    return (("authorization", "Bearer " + key),)


class Matrix(unittest.TestCase):
    def test_every_rpc_for_every_role_and_collection(self):
        self.assertEqual({s.name: {m.name for m in s.methods} for s, _ in methods()},
                         {s: set(rules) for s, rules in RULES.items()}, "the table lists every rpc")
        with SecuredServer() as server:
            with server.local() as local:
                for name in ("open", "closed"):
                    local.collections.CreateCollection(collections.CreateCollectionRequest(name=name), timeout=10)
            keys = {(role, some): server.make(role, collections=["open"] if some else []).secret
                    for role in (READER, WRITER, ADMIN) for some in (False, True)}
            channel = grpc.insecure_channel(server.address)
            for service, method in methods():
                needed, touches = RULES[service.name][method.name]
                for collection in ("open", "closed", "not there"):
                    with self.subTest(rpc=method.name, collection=collection, key=None):
                        self.assertEqual(call(channel, service, method, collection),
                                         grpc.StatusCode.UNAUTHENTICATED)
                        self.assertEqual(call(channel, service, method, collection, bearer("shapedb_1_2")),
                                         grpc.StatusCode.UNAUTHENTICATED)
                    for (role, some), key in keys.items():
                        with self.subTest(rpc=method.name, collection=collection, role=role, some=some):
                            code = call(channel, service, method, collection, bearer(key))
                            denied = (role < needed or (some and touches == WHOLE_SERVER) or
                                      (some and touches == COLLECTION and collection != "open"))
                            if denied:
                                self.assertEqual(code, grpc.StatusCode.PERMISSION_DENIED)
                            else:
                                self.assertNotIn(code, (grpc.StatusCode.PERMISSION_DENIED,
                                                        grpc.StatusCode.UNAUTHENTICATED,
                                                        grpc.StatusCode.INTERNAL))
                # What an allowed admin has deleted or made is put back.
                with server.local() as local:
                    for name in ("open", "closed"):
                        try:
                            local.collections.CreateCollection(
                                collections.CreateCollectionRequest(name=name), timeout=10)
                        except grpc.RpcError:
                            pass
            channel.close()

    def test_lists_only_the_collections_of_the_key(self):
        with SecuredServer() as server:
            with server.local() as local:
                for name in ("mine", "theirs"):
                    local.collections.CreateCollection(collections.CreateCollectionRequest(name=name), timeout=10)
            key = server.make(READER, collections=["mine", "not made yet"][:1]).secret
            with server.connect(key=key) as client:
                listed = client.collections.ListCollections(collections.ListCollectionsRequest(), timeout=10)
                self.assertEqual([c.name for c in listed.collections], ["mine"])

    def test_an_alias_is_what_it_stands_for(self):
        with SecuredServer() as server:
            def alias(collection, client):
                client.collections.SetAlias(collections.SetAliasRequest(alias="live", collection=collection), timeout=10)

            def count(client, collection):
                return client.shapes.CountShapes(shapes.CountShapesRequest(collection=collection), timeout=10).count

            def denied(make):
                with self.assertRaises(grpc.RpcError) as raised:
                    make()
                self.assertEqual(raised.exception.code(), grpc.StatusCode.PERMISSION_DENIED)
                return raised.exception.details()

            with server.local() as local:
                for name in ("mine", "theirs"):
                    local.collections.CreateCollection(collections.CreateCollectionRequest(name=name), timeout=10)
                alias("mine", local)
                mine = server.make(ADMIN, collections=["mine"]).secret
                live = server.make(READER, collections=["live"]).secret
                with server.connect(key=mine) as holder, server.connect(key=live) as follower:
                    self.assertEqual(count(holder, "live"), 0)
                    self.assertEqual(count(follower, "live"), 0)
                    denied(lambda: count(follower, "mine"))
                    alias("theirs", local)
                    told = denied(lambda: count(holder, "live"))
                    self.assertNotIn("theirs", told, "what an alias stands for is not told")
                    self.assertEqual(count(follower, "live"), 0)
                    # Nobody reaches a collection by an alias or a name of his own making.
                    denied(lambda: holder.collections.SetAlias(
                        collections.SetAliasRequest(alias="mine2", collection="mine"), timeout=10))
                    denied(lambda: holder.collections.SetAlias(
                        collections.SetAliasRequest(alias="mine", collection="theirs"), timeout=10))
                    denied(lambda: alias("mine", holder))
                    denied(lambda: holder.collections.DeleteAlias(
                        collections.DeleteAliasRequest(alias="live"), timeout=10))
                    denied(lambda: holder.collections.RenameCollection(
                        collections.RenameCollectionRequest(name="mine", new_name="other"), timeout=10))

    def test_an_import_is_for_the_collections_of_the_key_whatever_the_file_says(self):
        with SecuredServer() as server:
            with server.local() as local:
                for name in ("mine", "theirs"):
                    local.collections.CreateCollection(collections.CreateCollectionRequest(name=name), timeout=10)
                files = {name: list(local.admin.ExportCollection(
                    admin.ExportCollectionRequest(collection=name), timeout=30)) for name in ("mine", "theirs")}
                for name in files:
                    local.collections.DeleteCollection(collections.DeleteCollectionRequest(name=name), timeout=10)
            key = server.make(ADMIN, collections=["mine"]).secret
            with server.connect(key=key) as holder:
                def bring(file, name):
                    yield admin.ImportCollectionRequest(header=admin.ImportCollectionHeader(collection=name))
                    for chunk in files[file]:
                        yield admin.ImportCollectionRequest(chunk=chunk)

                for file, name in (("theirs", ""), ("theirs", "theirs"), ("mine", "theirs"), ("mine", "new")):
                    with self.subTest(file=file, name=name), self.assertRaises(grpc.RpcError) as raised:
                        holder.admin.ImportCollection(bring(file, name), timeout=30)
                    self.assertEqual(raised.exception.code(), grpc.StatusCode.PERMISSION_DENIED)
                # What is in the file is the holder's own affair, if the name is.
                self.assertEqual(holder.admin.ImportCollection(bring("theirs", "mine"), timeout=30).collection, "mine")
                holder.collections.DeleteCollection(collections.DeleteCollectionRequest(name="mine"), timeout=10)
                self.assertEqual(holder.admin.ImportCollection(bring("mine", ""), timeout=30).collection, "mine")
            with server.local() as local:
                listed = local.collections.ListCollections(collections.ListCollectionsRequest(), timeout=10)
                self.assertEqual([c.name for c in listed.collections], ["default", "mine"])


class Strangers(unittest.TestCase):
    def test_cannot_hold_threads_with_reflection(self):
        """Its streams would last for as long as the stranger likes, and it asks for no key."""
        with SecuredServer() as server, grpc.insecure_channel(server.address) as channel:
            info = channel.stream_stream("/grpc.reflection.v1alpha.ServerReflection/ServerReflectionInfo",
                                         request_serializer=bytes, response_deserializer=bytes)
            with self.assertRaises(grpc.RpcError) as error:
                list(info(iter([b""]), timeout=10))
            self.assertEqual(error.exception.code(), grpc.StatusCode.UNIMPLEMENTED)

    def test_learn_no_name_from_a_refusal(self):
        with SecuredServer() as server:
            with server.local() as local:
                for name in ("mine", "aaa-secret-merger"):
                    local.collections.CreateCollection(collections.CreateCollectionRequest(name=name), timeout=10)
            key = server.make(ADMIN, collections=["mine"]).secret
            with server.connect(key=key) as client, self.assertRaises(grpc.RpcError) as error:
                list(client.admin.Rebuild(admin.RebuildRequest(), timeout=10))
            self.assertEqual(error.exception.code(), grpc.StatusCode.PERMISSION_DENIED)
            self.assertNotIn("secret-merger", error.exception.details())


class Keys(unittest.TestCase):
    def test_live_as_long_as_they_should(self):
        with SecuredServer() as server:
            soon = timestamp_pb2.Timestamp()
            soon.FromDatetime(datetime.datetime.utcnow() + datetime.timedelta(seconds=8))
            short, long = server.make(WRITER, expires=soon), server.make(WRITER)
            with server.connect(key=short.secret) as client:
                self.assertEqual(client.count(), 0)
                self.assertTrue(eventually(lambda: self.refused(client), 60))
            with server.connect(key=long.secret) as client, server.local() as local:
                self.assertEqual(client.count(), 0)
                local.admin.RevokeKey(admin.RevokeKeyRequest(id=long.key.id), timeout=10)
                self.assertTrue(self.refused(client), "from the next call on")

    def refused(self, client):
        try:
            client.count()
            return False
        except grpc.RpcError as error:
            self.assertEqual(error.code(), grpc.StatusCode.UNAUTHENTICATED)
            return True

    def test_are_also_made_and_revoked_on_the_data_directory(self):
        with SecuredServer() as server:
            made = server.key_command("create", "--name", "by hand", "--role", "writer")
            secret = made.stdout.strip()
            with server.connect(key=secret) as client:
                self.assertTrue(eventually(lambda: not self.refused(client), 30), "within a second")
                listed = server.key_command("list").stdout
                key_id = next(line.split()[0] for line in listed.splitlines() if "by hand" in line)
                self.assertNotIn(secret.rsplit("_", 1)[1], listed)
                server.key_command("revoke", key_id)
                self.assertTrue(eventually(lambda: self.refused(client), 30))

    def test_without_a_key_nobody_makes_one_over_the_network(self):
        with Server() as server, server.connect() as client:  # loopback, keys optional
            self.assertEqual(client.count(), 0)
            with self.assertRaises(grpc.RpcError) as error:
                client.admin.CreateKey(admin.CreateKeyRequest(name="mine", role=ADMIN), timeout=10)
            self.assertEqual(error.exception.code(), grpc.StatusCode.UNAUTHENTICATED)

    def test_a_backup_holds_none_and_a_restore_revives_none(self):
        with SecuredServer() as server:
            key = server.make(ADMIN)
            with server.local() as local:
                backup = list(local.admin.Backup(admin.BackupRequest(), timeout=60))
                content = b"".join(chunk.data for chunk in backup)
                self.assertNotIn(key.key.id.encode(), content)
                local.admin.RevokeKey(admin.RevokeKeyRequest(id=key.key.id), timeout=10)
                local.admin.Restore(iter(backup), timeout=60)
            with server.connect(key=key.secret) as client:
                self.assertTrue(self.refused(client))

    def test_keep_to_their_rate_and_their_day(self):
        with SecuredServer() as server:
            slow = server.make(READER, limits=admin.KeyLimits(calls_per_second=1))
            with server.connect(key=slow.secret) as client:
                waits = []
                for _ in range(12):
                    try:
                        client.count()
                    except grpc.RpcError as error:
                        self.assertEqual(error.code(), grpc.StatusCode.RESOURCE_EXHAUSTED)
                        self.assertEqual(reason(error), "rate_limited")
                        waits.append(int(dict(error.trailing_metadata())["grpc-retry-pushback-ms"]))
                self.assertGreaterEqual(len(waits), 3)
                self.assertLessEqual(max(waits), 1_000)
                time.sleep(max(waits[-1], 1) / 1000)
                client.count()
            limits = admin.KeyLimits(scans_per_day=2, bytes_per_day=12 * 1_000)
            daily = server.make(WRITER, limits=limits)
            with server.connect(key=daily.secret) as client:
                client.add("first", ball(600), wait=False)
                self.limited(client, "too many bytes", ball(500))
                client.add("second", ball(400), wait=False)
                self.limited(client, "too many scans", ball(4))
            with server.local() as local:
                listed = {k.id: k for k in local.admin.ListKeys(admin.ListKeysRequest(), timeout=10).keys}
                self.assertEqual(listed[daily.key.id].scans_today, 2)
                self.assertEqual(listed[daily.key.id].bytes_today, 12_000)
            self.assertEqual(server.stop(), 0)
            server.start()
            with server.connect(key=daily.secret) as client:
                self.limited(client, "after a restart", ball(4))

    def test_bytes_that_never_came_are_not_charged(self):
        with SecuredServer() as server:
            daily = server.make(WRITER, limits=admin.KeyLimits(bytes_per_day=12 * 1_000))
            with server.connect(key=daily.secret) as client:
                def cut_off():
                    yield from list(upload("lost", ball(700)))[:1]
                    yield shapes.AddShapeRequest(chunk=types.PointChunk(xyz=pack(ball(100))))
                for _ in range(3):
                    with self.assertRaises(grpc.RpcError) as error:
                        client.shapes.AddShape(cut_off(), timeout=10)
                    self.assertEqual(reason(error.exception), "count_mismatch")
                client.add("kept", ball(700), wait=False)
                self.limited(client, "too many bytes", ball(4))
            with server.local() as local:
                listed = {k.id: k for k in local.admin.ListKeys(admin.ListKeysRequest(), timeout=10).keys}
                self.assertEqual(listed[daily.key.id].bytes_today, 12_000)

    def test_never_expire_beyond_what_clients_can_tell(self):
        from google.protobuf import timestamp_pb2
        with SecuredServer() as server:
            for seconds in (1 << 62, 253_402_300_800, -(1 << 62)):
                with self.assertRaises(grpc.RpcError) as error:
                    server.make(READER, expires=timestamp_pb2.Timestamp(seconds=seconds))
                self.assertEqual(reason(error.exception), "invalid_argument")
            late = server.make(READER, expires=timestamp_pb2.Timestamp(seconds=253_402_300_799))
            self.assertEqual(late.key.expires.seconds, 253_402_300_799)

    def test_of_a_server_that_nobody_can_administer_are_told(self):
        with SecuredServer() as server:
            self.assertNotIn("has the role admin", server.log())
            with server.local() as local:
                first = local.admin.ListKeys(admin.ListKeysRequest(), timeout=10).keys[0]
                server.make(READER)
                local.admin.RevokeKey(admin.RevokeKeyRequest(id=first.id), timeout=10)
            self.assertEqual(server.stop(), 0)
            server.start()
            self.assertIn("nobody can store anything", server.log())
            self.assertIn("highest_role=reader", server.log())

    def limited(self, client, name, points):
        with self.assertRaises(grpc.RpcError) as error:
            client.add(name, points, wait=False)
        self.assertEqual(reason(error.exception), "rate_limited")


class Secrets(unittest.TestCase):
    def test_are_told_nowhere(self):
        with SecuredServer("--log-level", "trace", "--log-format", "json") as server:
            key = server.make(READER)
            secret = key.secret.rsplit("_", 1)[1]
            wrong = key.secret[:-4] + "beef"
            answers = []
            for presented in (key.secret, wrong, key.secret.upper(), "Basic " + key.secret):
                with server.connect(key=presented) as client:
                    for attempt in (client.count, lambda c=client: c.admin.Stats(admin.StatsRequest(), timeout=10)):
                        try:
                            attempt()
                        except grpc.RpcError as error:
                            answers.append(error.details())
            for text in answers:
                self.assertNotIn(secret[:16], text.lower())
            shown = subprocess.run([os.environ["SHAPEDBD"], "--data", server.data, "--check-config"],
                                   capture_output=True, text=True, check=True).stdout
            self.assertNotIn(secret[:16], shown)
            with open(f"/proc/{server.process.pid}/cmdline") as line:
                self.assertNotIn(secret[:16], line.read())
            self.assertEqual(server.stop(), 0)
            self.assertIn("caller", server.log())
            files = [server.log_path, *glob.glob(server.data + "/**", recursive=True)]
            for path in files:
                if os.path.isfile(path):
                    with open(path, "rb") as content:
                        found = content.read().lower()
                    self.assertNotIn(secret[:16].encode(), found, path)
                    self.assertNotIn(wrong[-20:].encode(), found, path)

    def test_that_are_revoked_meanwhile_store_nothing_any_more(self):
        def chunks(points):
            for first in range(0, len(points), 100):
                yield shapes.AddShapeRequest(chunk=types.PointChunk(xyz=pack(points[first:first + 100])))

        with SecuredServer() as server, server.local() as local:
            local.add("kept", ball(300))
            backup = [chunk for chunk in local.admin.Backup(admin.BackupRequest(), timeout=30)]

            def add(begun, revoked):
                yield shapes.AddShapeRequest(header=shapes.AddShapeHeader(key="late", point_count=1_000))
                yield from chunks(ball(1_000))
                begun.set()
                revoked.wait(30)  # all is sent but the end

            def restore(begun, revoked):
                yield from backup
                begun.set()
                revoked.wait(30)

            for role, messages, call in ((WRITER, add, lambda client: client.shapes.AddShape.future),
                                         (ADMIN, restore, lambda client: client.admin.Restore.future)):
                key = server.make(role)
                begun, revoked = threading.Event(), threading.Event()
                with server.connect(key=key.secret) as client:
                    running = call(client)(messages(begun, revoked), timeout=60)
                    self.assertTrue(begun.wait(30))
                    local.add("after the backup", ball(200))
                    local.admin.RevokeKey(admin.RevokeKeyRequest(id=key.key.id), timeout=10)
                    revoked.set()
                    error = running.exception()
                    self.assertEqual(reason(error), "unauthenticated", error)
                    self.assertIn("was revoked", error.details())
                self.assertEqual(local.count(), 2, "what is there is as it was")

    def test_a_download_ends_soon_after_its_key(self):
        def soon(end):
            moment = timestamp_pb2.Timestamp()
            moment.FromDatetime(end)
            return moment

        with SecuredServer() as server, server.local() as local:
            local.add("large", [(i % 1000, i // 1000, (i * i) % 999) for i in range(1_000_000)], timeout=120)
            for ended in ("was revoked", "has expired"):
                # Late enough for a slow machine to begin the download.
                end = datetime.datetime.utcnow() + datetime.timedelta(seconds=6)
                expires = {"expires": soon(end)} if ended == "has expired" else {}
                key = server.make(READER, **expires)
                with self.subTest(ended), server.connect(key=key.secret) as client:
                    request = shapes.GetPointsRequest(shape=shapes.ShapeRef(key="large"))
                    download = client.shapes.GetPoints(request, timeout=60)
                    self.assertEqual(next(download).shape.key, "large")
                    if ended == "was revoked":
                        local.admin.RevokeKey(admin.RevokeKeyRequest(id=key.key.id), timeout=10)
                    else:
                        time.sleep(max(0, (end - datetime.datetime.utcnow()).total_seconds()))
                    time.sleep(3)  # what is not read stops the server from sending more
                    with self.assertRaises(grpc.RpcError) as failure:
                        for _ in download:
                            pass
                    self.assertEqual(failure.exception.code(), grpc.StatusCode.UNAUTHENTICATED)
                    self.assertIn(ended, failure.exception.details())

    def test_a_long_upload_ends_soon_after_its_key(self):
        with SecuredServer("--metrics-listen", "127.0.0.1:0") as server:
            key = server.make(WRITER)
            stop = threading.Event()

            def drip():
                yield shapes.AddShapeRequest(header=shapes.AddShapeHeader(key="slow", point_count=1_000_000))
                while not stop.wait(0.1):
                    yield shapes.AddShapeRequest(chunk=types.PointChunk(xyz=b"\0" * 12_000))

            with server.connect(key=key.secret) as client:
                running = client.shapes.AddShape.future(drip(), timeout=60)
                self.assertTrue(eventually(lambda: server.begun() == 1))
                # By another process: it is noticed within a second.
                server.key_command("revoke", key.key.id)
                began = time.monotonic()
                self.assertEqual(reason(running.exception()), "unauthenticated")
                self.assertLess(time.monotonic() - began, 20, "not only when the client has sent everything")
                stop.set()

    def test_a_flood_of_refusals_pushes_nothing_out_of_the_audit_log(self):
        with SecuredServer() as server:
            with server.connect() as stranger:
                calls = [stranger.shapes.CountShapes.future(shapes.CountShapesRequest(), timeout=60)
                         for _ in range(1_500)]
                self.assertTrue(all(call.exception() is not None for call in calls))
            self.assertLess(len(self.lines(server, "audit.refused.log")), 220)
            server.stop()
            told = self.lines(server, "audit.refused.log")[-1]
            self.assertGreater(told["left_out"], 1_200)
            self.assertIn("127.0.0.1: ", told["of"])

    def test_the_audit_log_tells_who_did_what(self):
        with SecuredServer() as server:
            key = server.make(ADMIN, name="ann")
            with server.connect(key=key.secret) as client:
                client.collections.CreateCollection(collections.CreateCollectionRequest(name="bones"), timeout=10)
                client.count()
            with server.connect() as stranger:
                with self.assertRaises(grpc.RpcError):
                    stranger.count()
            done, refused = self.lines(server, "audit.log"), self.lines(server, "audit.refused.log")
            self.assertEqual([line["rpc"] for line in done], ["CreateKey", "CreateCollection"])
            self.assertEqual(done[0]["api_key_name"], "ann")
            self.assertEqual(done[1]["caller"], key.key.id)
            self.assertEqual(done[1]["collection"], "bones")
            self.assertEqual([line["rpc"] for line in refused], ["CountShapes"])
            self.assertNotIn("caller", refused[0])

    def lines(self, server, name):
        with open(server.data + "/" + name) as file:
            return [json.loads(line) for line in file]

    def test_one_call_cannot_fill_a_log(self):
        with SecuredServer() as server:
            key = server.make(READER, collections=["bones"])
            with server.connect(key=key.secret) as client:
                for _ in range(5):
                    with self.assertRaises(grpc.RpcError):
                        client.shapes.CountShapes(shapes.CountShapesRequest(collection="A" * (3 << 20)), timeout=10)
            for line in self.lines(server, "audit.refused.log"):
                self.assertLess(len(json.dumps(line)), 8_192)
            self.assertLess(len(server.log()), 65_536)


if __name__ == "__main__":
    main()
