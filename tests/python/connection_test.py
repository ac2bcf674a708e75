# SPDX-License-Identifier: Apache-2.0
"""Addresses, keys and TLS options; secrets stay secret."""

import os
import traceback

import pytest
import shapedb
from shapedb._address import checked_address
from shapedb._connection import is_this_machine, target_of

SECRET = "shapedb_1234_s3cr3t"


def target(address=None, environment=None, **options):
    names = ("api_key", "api_key_file", "tls", "tls_ca", "client_certificate", "client_key", "server_name")
    given = {**dict.fromkeys(names), **options}
    return target_of(address, environment=environment or {}, **given)


def refusal(*args, **options):
    with pytest.raises(shapedb.ShapeDBError) as error:
        target(*args, **options)
    return error.value


@pytest.mark.parametrize("given, meant", [
    ("localhost", "localhost:7878"), ("host:1", "host:1"), ("::1", "[::1]:7878"), ("[::1]", "[::1]:7878"),
    ("[::1]:5", "[::1]:5"), ("fe80::1%eth0", "[fe80::1%eth0]:7878"), ("unix:/run/x", "unix:/run/x"), ("dns:///host:1", "dns:///host:1"),
])
def test_the_port_is_added(given, meant):
    assert checked_address(given) == meant


@pytest.mark.parametrize("given, why", [
    ("http://host:7879", "web address"), ("https://host", "TLS is switched on apart"), ("host:99999", "'99999' is not a port"),
    ("host:0", "not a port"), ("host:", "no port after the colon"), ("host:http", "'http' is not a port"), (":7878", "no host"),
    ("grpc://host:1", "grpc://"), ("host:1/path", "more than a host"), ("a b:1", "blank"), ("[::1", "] is missing"),
    ("[::1]x", "after ]"), ("host:1:2", "more than one colon"), ("unix:", "nothing follows"),
])
def test_a_wrong_address_is_told_before_anybody_connects(given, why):
    error = refusal(given)
    assert error.reason == "invalid_argument" and why in error.message and "HOST:PORT" in error.message


@pytest.mark.parametrize("address, local", [
    ("127.0.0.1:1", True), ("127.9.9.9:1", True), ("localhost:1", True), ("[::1]:1", True), ("unix:/x", True),
    ("127.example.org:1", False), ("10.0.0.1:1", False), ("localhost.example:1", False), ("[::2]:1", False),
])
def test_what_is_this_machine(address, local):
    assert is_this_machine(address) is local


def test_the_environment_says_what_the_arguments_do_not(tmp_path):
    (tmp_path / "key").write_text(SECRET + "\nmore\n")
    found = target(environment={"SHAPEDB_SERVER": "localhost:9", "SHAPEDB_API_KEY_FILE": str(tmp_path / "key")})
    assert found.address == "localhost:9" and found.metadata == (("authorization", "Bearer " + SECRET),)
    other = target("localhost:8", api_key="other", environment={"SHAPEDB_API_KEY": SECRET, "SHAPEDB_SERVER": "x"})
    assert other.address == "localhost:8" and other.metadata == (("authorization", "Bearer other"),)
    # As in the command: a key file that is given counts for more than a key in the environment.
    file = target(api_key_file=tmp_path / "key", environment={"SHAPEDB_API_KEY": "from-environment"})
    assert file.metadata[0][1] == "Bearer " + SECRET
    both = target(environment={"SHAPEDB_API_KEY": "one", "SHAPEDB_API_KEY_FILE": str(tmp_path / "missing")})
    assert both.metadata[0][1] == "Bearer one"


def test_a_key_never_travels_unprotected():
    error = refusal("example.org", api_key=SECRET)
    assert error.reason == "invalid_argument" and "unprotected to example.org:7878" in error.message
    assert target("example.org", api_key=SECRET, tls=True).credentials is not None


def test_key_files_that_cannot_be_used(tmp_path):
    assert refusal(api_key_file=tmp_path / "none").reason == "file_not_readable"
    assert refusal(api_key_file=tmp_path).reason == "file_not_readable"
    (tmp_path / "empty").write_text("\nkey on the second line")
    assert "no key in its first line" in refusal(api_key_file=tmp_path / "empty").message
    os.mkfifo(tmp_path / "pipe")
    assert refusal(api_key_file=tmp_path / "pipe").reason == "file_not_readable"
    (tmp_path / "odd").write_text("a key with blanks\n")
    assert "a character that no key has" in refusal(api_key_file=tmp_path / "odd").message
    (tmp_path / "large").write_bytes(b"x" * (1 << 21))
    assert refusal(api_key_file=tmp_path / "large").reason == "malformed_file"


def test_tls_options_that_contradict_each_other(tmp_path):
    pem = tmp_path / "x.pem"
    pem.write_text("x")
    assert "TLS is not enabled" in refusal(client_certificate=pem).message
    assert "TLS is not enabled" in refusal(tls_ca=pem, tls=False).message
    assert "belong together" in refusal(tls=True, client_certificate=pem).message
    assert "CA file" in refusal(tls_ca=tmp_path / "none").message
    assert target(environment={"SHAPEDB_TLS": "1"}).credentials is not None
    assert target(environment={"SHAPEDB_TLS": "0"}).credentials is None
    assert ("grpc.ssl_target_name_override", "name") in target(tls=True, server_name="name").options


def test_secrets_are_in_no_text():
    client = shapedb.Client("127.0.0.1:1", api_key=SECRET, environment={}, timeout=1,
                            retry=shapedb.RetryPolicy(max_attempts=1))
    shown = [repr(client), str(client), repr(client._transport.target), repr(client._transport.target.metadata),
             repr(client.collection())]
    try:
        client.collection().count()
    except shapedb.ShapeDBError as error:
        shown += [str(error), repr(error)]
        shown += traceback.TracebackException.from_exception(error, capture_locals=True).format()
    client.close()
    assert len(shown) > 7
    assert not [text for text in shown if "s3cr3t" in text]
