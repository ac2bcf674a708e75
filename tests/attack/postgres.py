# SPDX-License-Identifier: GPL-3.0-or-later
"""A PostgreSQL server for one test: in a folder below /tmp, on a Unix socket in it, gone at the end."""

import glob
import os
import pwd
import shutil
import subprocess
import tempfile
import unittest


class Postgres:
    def __init__(self):
        found = sorted(glob.glob("/usr/lib/postgresql/*/bin/initdb"))
        if not found:
            missing = "PostgreSQL is not installed: scripts/install-deps.sh --postgres"
            if os.environ.get("REQUIRE_POSTGRES"):
                raise RuntimeError(missing)
            raise unittest.SkipTest(missing)
        self._programs = os.path.dirname(found[-1])
        self.folder = tempfile.mkdtemp(prefix="shapedb-postgres-", dir="/tmp")
        self._as_user = []
        if os.geteuid() == 0:
            owner = pwd.getpwnam("postgres")
            os.chown(self.folder, owner.pw_uid, owner.pw_gid)
            self._as_user = ["runuser", "-u", "postgres", "--"]
        self._run("initdb", "-D", self._data(), "-U", "postgres", "-A", "trust", "-E", "UTF8", "--locale=C")
        self.start()
        self._run("createdb", "-h", self.folder, "-U", "postgres", "--template", "template0", "shapes")
        self.uri = f"host={self.folder} user=postgres dbname=shapes"

    def _data(self):
        return os.path.join(self.folder, "data")

    def _run(self, program, *arguments):
        subprocess.run([*self._as_user, os.path.join(self._programs, program), *arguments], check=True, cwd="/",
                       stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)

    def start(self):
        # With fsync on: what is acknowledged must survive the death of the processes.
        self._run("pg_ctl", "-D", self._data(), "-w", "-l", os.path.join(self.folder, "log"), "-o",
                  f"-k {self.folder} -c listen_addresses= -c shared_buffers=32MB", "start")

    def kill(self):
        """As a crash: no checkpoint, connections are cut."""
        self._run("pg_ctl", "-D", self._data(), "-w", "-m", "immediate", "stop")

    def __enter__(self):
        return self

    def __exit__(self, *error):
        try:
            self.kill()
        except subprocess.CalledProcessError:
            pass  # it is down already
        shutil.rmtree(self.folder, ignore_errors=True)
