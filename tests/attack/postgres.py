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
    def __init__(self, *settings, standby_of=None, disk=None):
        """`settings`: as "work_mem=1MB". `standby_of`: a copy of that one, which follows it. `disk`: the size of a
        disk of its own for its data (mount's, as "100m"), not for its log of changes."""
        found = sorted(glob.glob("/usr/lib/postgresql/*/bin/initdb"))
        if not found:
            missing = "PostgreSQL is not installed: scripts/install-deps.sh --postgres"
            if os.environ.get("REQUIRE_POSTGRES"):
                raise RuntimeError(missing)
            raise unittest.SkipTest(missing)
        self._programs = os.path.dirname(found[-1])
        self._settings = settings
        self.folder = tempfile.mkdtemp(prefix="shapedb-postgres-", dir="/tmp")
        self._as_user = []
        self._disk = None
        self.databases = 0
        try:
            if os.geteuid() == 0:
                owner = pwd.getpwnam("postgres")
                os.chown(self.folder, owner.pw_uid, owner.pw_gid)
                self._as_user = ["runuser", "-u", "postgres", "--"]
            if disk:
                self._mount(disk)
            self.uri = f"host={self.folder} user=postgres dbname=shapes"
            if standby_of:
                self._run("pg_basebackup", "-D", self._data(), "-c", "fast", "-R", "-d",
                          f"host={standby_of.folder} user=postgres application_name=standby")
                self.start()
                return
            self._run("initdb", "-D", self._data(), "-X", os.path.join(self.folder, "wal"), "--wal-segsize=4", "-U",
                      "postgres", "-A", "trust", "-E", "UTF8", "--locale=C")
            self.start()
            self._run("createdb", "-h", self.folder, "-U", "postgres", "--template", "template0", "shapes")
        except BaseException:
            self.__exit__()
            raise

    def _data(self):
        return os.path.join(self.folder, "disk", "data") if self._disk else os.path.join(self.folder, "data")

    def _mount(self, size):
        """In a mount namespace that a process of ours keeps, so that nothing is left of it."""
        os.mkdir(os.path.join(self.folder, "disk"))
        mount = (f"mount -t tmpfs -o size={size} tmpfs {self.folder}/disk && chmod 777 {self.folder}/disk && echo && "
                 "exec cat")
        self._disk = subprocess.Popen(["unshare", "--mount", "sh", "-c", mount], stdin=subprocess.PIPE,
                                      stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
        if not self._disk.stdout.readline():
            raise unittest.SkipTest("this user may not mount a disk for the database")
        self._as_user = ["nsenter", "--mount", "-t", str(self._disk.pid), *self._as_user]

    def _run(self, program, *arguments):
        subprocess.run([*self._as_user, os.path.join(self._programs, program), *arguments], check=True, cwd="/",
                       stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)

    def start(self):
        # With fsync on: what is acknowledged must survive the death of the processes.
        settings = ("listen_addresses=", "shared_buffers=32MB", "recovery_init_sync_method=syncfs", *self._settings)
        self._run("pg_ctl", "-D", self._data(), "-w", "-l", os.path.join(self.folder, "log"), "-o",
                  " ".join([f"-k {self.folder}", *(f"-c {one}" for one in settings)]), "start")

    def kill(self):
        """As a crash: no checkpoint, connections are cut."""
        self._run("pg_ctl", "-D", self._data(), "-w", "-m", "immediate", "stop")

    def promote(self):
        self._run("pg_ctl", "-D", self._data(), "-w", "promote")

    def reload(self):
        self._run("pg_ctl", "-D", self._data(), "reload")

    def psql(self, script, uri=None):
        """psql, running, that has been given this script."""
        command = [os.path.join(self._programs, "psql"), "-XAtq", "-v", "ON_ERROR_STOP=1", "-d",
                   uri or self.uri]
        process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        process.stdin.write(script)
        process.stdin.flush()
        return process

    def another(self):
        """The URI of an empty database."""
        self.databases += 1
        name = f"shapes{self.databases}"
        self._run("createdb", "-h", self.folder, "-U", "postgres", "--template", "template0", name)
        return f"host={self.folder} user=postgres dbname={name}"

    def query(self, sql, uri=None):
        """What psql prints for it."""
        process = self.psql("", uri)
        printed, _ = process.communicate(sql)
        if process.returncode:
            raise RuntimeError("psql failed: " + sql)
        return printed.strip()

    def on_disk(self, *command):
        """A program among the files of the data."""
        return subprocess.run([*self._as_user, *command], cwd="/", capture_output=True, text=True, check=False)

    def log(self):
        with open(os.path.join(self.folder, "log"), encoding="utf-8", errors="replace") as log:
            return log.read()

    def __enter__(self):
        return self

    def __exit__(self, *error):
        try:
            self.kill()
        except subprocess.CalledProcessError:
            pass  # it is down already
        if self._disk:
            self._disk.communicate()
        shutil.rmtree(self.folder, ignore_errors=True)
