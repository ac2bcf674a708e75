# SPDX-License-Identifier: Apache-2.0
"""A server of one's own: it starts, says why it does not, and never outlives its program."""

import os
import signal
import subprocess
import sys
import threading
import time

import pytest
import shapedb

import solids

PROGRAM = """
import os, sys, shapedb
client = shapedb.local({data!r})
print(client.server._process.pid, client.server.data, flush=True)
{then}
"""


def started(then, data=None):
    """A program that starts a server, the process of that, and its data."""
    process = subprocess.Popen([sys.executable, "-c", PROGRAM.format(data=data, then=then)], stdin=subprocess.PIPE,
                               stdout=subprocess.PIPE, text=True)
    pid, path = process.stdout.readline().split()
    return process, int(pid), path


def gone(pid, seconds=20):
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        try:
            os.kill(pid, 0)
            with open(f"/proc/{pid}/stat") as stat:
                if stat.read().rsplit(")", 1)[1].split()[0] == "Z":
                    return True
        except (ProcessLookupError, FileNotFoundError):
            return True
        time.sleep(0.05)
    return False


def test_data_are_kept_or_not(tmp_path, monkeypatch):
    monkeypatch.setenv("SHAPEDB_SERVER", "elsewhere:1")
    monkeypatch.setenv("SHAPEDB_LISTEN", "0.0.0.0:1")
    monkeypatch.setenv("SHAPEDB_NO_SUCH_SETTING", "1")
    with shapedb.local(tmp_path / "data") as client:
        client.collection().add("egg", solids.ball(50))
        assert client.server.running and "listening" in client.server.log()
    assert not client.server.running
    with shapedb.local(tmp_path / "data") as client:
        assert client.collection().exists("egg")
        own = shapedb.local()
        folder = own.server.data
        assert folder.exists() and own.collection().count() == 0
        own.close()
        own.close()
        assert not folder.exists()


def test_a_server_may_be_started_by_a_thread_that_ends():
    made = []
    thread = threading.Thread(target=lambda: made.append(shapedb.local()))
    thread.start()
    thread.join()
    time.sleep(0.2)
    with made[0] as client:
        assert client.health() == "serving"


def test_why_it_does_not_start(tmp_path):
    with pytest.raises(shapedb.ShapeDBError) as error:
        shapedb.local(program=tmp_path / "nothing")
    assert error.value.reason == "file_not_readable" and "SHAPEDBD" in error.value.message
    with pytest.raises(shapedb.ShapeDBError) as error:
        shapedb.local(flags=["--no-such-flag"])
    assert error.value.reason == "unavailable" and "no-such-flag" in error.value.message
    with shapedb.local(tmp_path / "data"), pytest.raises(shapedb.ShapeDBError) as error:
        shapedb.local(tmp_path / "data")
    assert error.value.reason == "unavailable" and len(error.value.message) > 50


def test_the_server_ends_with_a_program_that_forgets_it():
    process, pid, data = started("")
    process.communicate(timeout=60)
    assert process.returncode == 0 and gone(pid) and not os.path.exists(data)


def test_the_server_ends_with_a_program_that_is_killed(tmp_path):
    process, pid, _ = started("import time; time.sleep(60)", str(tmp_path / "data"))
    process.kill()
    process.communicate()
    assert gone(pid)


def test_ctrl_c_is_for_the_program(tmp_path):
    then = """
try:
    print("ready", flush=True)
    sys.stdin.read()
except KeyboardInterrupt:
    print(client.collection().count(), flush=True)
client.close()
"""
    process, pid, _ = started(then)
    assert process.stdout.readline() == "ready\n"
    process.send_signal(signal.SIGINT)
    output, _ = process.communicate(timeout=60)
    assert output == "0\n" and process.returncode == 0 and gone(pid)
