# SPDX-License-Identifier: Apache-2.0
"""Maintenance, API keys and TLS."""

import datetime
import os
import subprocess

import numpy as np
import pytest
import shapedb

import solids
from conftest import QUICK


def reason_of(call, *args, **options):
    with pytest.raises(shapedb.ShapeDBError) as error:
        call(*args, **options)
    return error.value.reason


def test_what_a_server_says_of_itself(client):
    assert client.health() == "serving" and client.health("shapedb.v1.SearchService") == "serving"
    assert reason_of(client.health, "shapedb.v1.NoService") == "not_found"
    info = client.server_info()
    assert info.version == shapedb.__version__ and info.limits.max_k > 0 and info.limits.max_chunk_bytes == 1 << 20
    table = {limit.name: limit for limit in info.limit_table}
    assert table["limits.max_points"].value == info.limits.max_points
    assert table["limits.max_points"].refusal == "point_limit_exceeded" and table["limits.max_points"].bounds
    stats = client.stats()
    assert stats.collections >= 1 and stats.uptime_seconds > 0 and stats.missing_commits == 0


def test_backup_restore_export_import(client, tmp_path):
    collection = client.create_collection("kept", parameters=QUICK)
    collection.add("box", solids.box(200), metadata={"a": "b"}, wait=True)
    told = []
    report = client.backup(tmp_path / "all.sqlite", progress=told.append)
    assert report.bytes == (tmp_path / "all.sqlite").stat().st_size == told[-1].done and len(report.sha256) == 64
    exported = collection.export(tmp_path / "kept.sqlite")
    assert exported.bytes == (tmp_path / "kept.sqlite").stat().st_size
    assert sorted(os.listdir(tmp_path)) == ["all.sqlite", "kept.sqlite"], "no partial files"
    imported = client.import_collection(tmp_path / "kept.sqlite", "copy")
    assert (imported.collection, imported.shapes, imported.shapes_pending) == ("copy", 1, 0)
    np.testing.assert_array_equal(client.collection("copy").points("box"), collection.points("box"))
    assert reason_of(client.import_collection, tmp_path / "kept.sqlite") == "already_exists"
    assert client.check() == ()
    assert client.check(acknowledge=True) == ()
    restored = client.restore(tmp_path / "all.sqlite")
    assert restored.shapes >= 1 and reason_of(client.collection("copy").info) == "not_found"
    assert collection.get("box").metadata == {"a": "b"}
    (tmp_path / "junk").write_bytes(b"no database" * 1000)
    (tmp_path / "empty").write_bytes(b"")
    assert reason_of(client.restore, tmp_path / "junk") == "malformed_file"
    for unreadable in ("empty", "missing"):
        assert reason_of(client.restore, tmp_path / unreadable) == "file_not_readable"
    assert reason_of(client.backup, tmp_path / "no folder" / "x") == "file_not_writable"
    assert reason_of(client.collection("missing").export, tmp_path / "x") == "not_found"
    assert not (tmp_path / "x").exists() and not list(tmp_path.glob("*.partial"))


def test_increments_continue_a_backup(client, tmp_path):
    collection = client.create_collection("grown", parameters=QUICK)
    collection.add("box", solids.box(200), wait=True)
    full, first, second = (tmp_path / name for name in ("full", "1.inc", "2.inc"))
    client.backup(full)
    collection.add("ball", solids.ball(300), wait=True)
    report = client.backup(first, since=full)
    assert report.bytes == first.stat().st_size < full.stat().st_size
    collection.delete("box")
    client.backup(second, since=first)
    assert reason_of(client.backup, second, since=first) == "already_exists", "others may continue it"
    collection.delete("ball")
    client.restore(full, first, second)
    assert [shape.key for shape in collection.shapes()] == ["ball"]
    client.restore(full, first)
    assert sorted(shape.key for shape in collection.shapes()) == ["ball", "box"]
    assert client.check() == ()
    np.testing.assert_array_equal(collection.points("ball").shape, (300, 3))

    assert reason_of(client.restore, first) == "invalid_argument", "a full backup comes first"
    assert reason_of(client.restore, full, second) == "checksum_mismatch", "one between is missing"
    assert reason_of(client.restore, full, first, first) == "invalid_argument"
    assert reason_of(client.backup, tmp_path / "x", since=tmp_path / "missing") == "file_not_readable"
    damaged = bytearray(first.read_bytes())
    damaged[-1] ^= 1
    (tmp_path / "damaged").write_bytes(damaged)
    assert reason_of(client.restore, full, tmp_path / "damaged") == "checksum_mismatch"
    damaged[120] ^= 1
    (tmp_path / "damaged").write_bytes(damaged)
    assert reason_of(client.restore, full, tmp_path / "damaged") == "malformed_file"
    (tmp_path / "junk").write_bytes(b"no database" * 1000)
    assert reason_of(client.backup, tmp_path / "x", since=tmp_path / "junk") == "malformed_file"
    assert not (tmp_path / "x").exists()


def test_a_rebuild_is_followed(client):
    collection = client.create_collection("rebuilt", parameters=QUICK)
    collection.add_many({f"s{n}": solids.ball(60, seed=n) for n in range(3)}, progress=False)
    collection.wait_until_ready()
    told = []
    last = collection.rebuild(parameters=shapedb.Parameters(max_points=3, unit="m"), progress=told.append)
    assert len(last) == 1 and last[0].finished and (last[0].done, last[0].total, last[0].failed) == (3, 3, 0)
    assert told[-1] == last[0] and collection.info().generation == 2 and collection.info().parameters.max_points == 3
    assert "rebuilt" in [one.collection for one in client.rebuild(cache_only=True)]
    assert reason_of(collection.cancel_rebuild) == "not_found"
    assert reason_of(client.collection("missing").rebuild) == "not_found"


def first_key(data):
    """The first is made on the server's machine."""
    subprocess.run([os.environ["SHAPEDBD"], "key", "create", "--name", "first", "--role", "admin", "--data", str(data)],
                   check=True, capture_output=True)


@pytest.fixture(scope="module")
def secured(tmp_path_factory):
    """A server that demands keys, and the client at its Unix socket."""
    folder = tmp_path_factory.mktemp("secured")
    socket = f"{folder}/socket"
    first_key(folder / "data")
    with shapedb.LocalServer(folder / "data", flags=["--unix-socket", socket, "--security-keys", "always"]) as server:
        with shapedb.Client("unix:" + socket, environment={}) as admin:
            yield server, admin


def test_keys(secured, tmp_path):
    server, admin = secured
    tomorrow = datetime.datetime.now(datetime.timezone.utc) + datetime.timedelta(days=1)
    made = admin.create_key("reader in room 4", "reader", collections=["default"], expires=tomorrow,
                            limits=shapedb.KeyLimits(calls_per_second=50))
    assert made.secret.startswith("shapedb_") and made.secret not in repr(made)
    key = made.key
    assert (key.name, key.role, key.collections) == ("reader in room 4", "reader", ("default",))
    assert key.limits == shapedb.KeyLimits(calls_per_second=50)
    assert abs(key.expires - tomorrow) < datetime.timedelta(seconds=1) and key.revoked is None
    (tmp_path / "key").write_text(made.secret + "\n")
    with shapedb.Client(server.address, api_key_file=tmp_path / "key", environment={}) as reader:
        assert reader.collection().count() == 0
        assert reason_of(reader.collection().add, "x", solids.ball(20)) == "permission_denied"
        assert reason_of(reader.collection("other").count) == "permission_denied"
        assert [one.name for one in admin.keys()] == ["first", "reader in room 4"]
        assert admin.revoke_key(key.id).revoked is not None
        assert reason_of(reader.collection().count) == "unauthenticated"
    with shapedb.Client(server.address, environment={"SHAPEDB_API_KEY": "shapedb_0_wrong"}) as nobody:
        assert reason_of(nobody.stats) == "unauthenticated"
    assert reason_of(admin.revoke_key, key.id) == "not_found"
    for wrong in ({"role": "king"}, {"collections": "default"}, {"expires": datetime.datetime.now()}):
        assert reason_of(admin.create_key, "x", **{"role": "reader", **wrong}) == "invalid_argument"


def test_a_rate_limit_is_waited_for(secured):
    server, admin = secured
    secret = admin.create_key("slow", "reader", limits=shapedb.KeyLimits(calls_per_second=5)).secret
    with shapedb.Client(server.address, api_key=secret, environment={}) as slow:
        for _ in range(12):
            slow.collection().count()
    once = shapedb.RetryPolicy(max_queue_attempts=1)
    with shapedb.Client(server.address, api_key=secret, environment={}, retry=once) as eager:
        with pytest.raises(shapedb.ShapeDBError, match="rate_limited"):
            for _ in range(500):
                eager.collection().count()


def certificates(folder):
    """An authority, and what it signs for localhost."""
    def openssl(*arguments):
        subprocess.run(["openssl", *arguments], check=True, capture_output=True, cwd=folder)

    curve = ("-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes")
    openssl("req", "-x509", *curve, "-days", "2", "-keyout", "ca.key", "-out", "ca.pem", "-subj", "/CN=authority")
    (folder / "names").write_text("subjectAltName=DNS:localhost")
    for name in ("server", "person"):
        openssl("req", *curve, "-keyout", name + ".key", "-out", name + ".csr", "-subj", "/CN=" + name)
        openssl("x509", "-req", "-in", name + ".csr", "-CA", "ca.pem", "-CAkey", "ca.key", "-CAcreateserial", "-days",
                "2", "-extfile", "names", "-out", name + ".pem")


def test_tls_and_client_certificates(tmp_path):
    certificates(tmp_path)
    flags = ["--tls-certificate", f"{tmp_path}/server.pem", "--tls-key", f"{tmp_path}/server.key", "--tls-client-ca",
             f"{tmp_path}/ca.pem"]
    once = shapedb.RetryPolicy(max_attempts=1)
    person = {"client_certificate": tmp_path / "person.pem", "client_key": tmp_path / "person.key"}
    with shapedb.LocalServer(tmp_path / "data", flags=flags) as server:
        address = "localhost:" + server.address.rsplit(":", 1)[1]

        def client(address=address, **options):
            return shapedb.Client(address, environment={}, retry=once, timeout=20, **options)

        with client(tls_ca=tmp_path / "ca.pem", **person) as known:
            assert known.collection().count() == 0 and "with TLS" in repr(known)
        with client(server.address, tls_ca=tmp_path / "ca.pem", server_name="localhost", **person) as renamed:
            assert renamed.collection().count() == 0
        for wrong in ({"tls_ca": tmp_path / "ca.pem"}, {"tls": True, **person}, {}):
            with client(**wrong) as stranger:
                assert reason_of(stranger.collection().count) == "unavailable"
