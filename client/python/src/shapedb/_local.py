# SPDX-License-Identifier: Apache-2.0
"""A server of one's own, for notebooks, scripts and tests."""

from __future__ import annotations

import atexit
import os
import shutil
import subprocess
import tempfile
import threading
from pathlib import Path
from typing import List, Mapping, Optional, Sequence

from ._client import Client
from ._connection import PathLike
from ._errors import ShapeDBError
from ._retry import RetryPolicy

_STOP_SECONDS = 30.0


class LocalServer:
    """`shapedbd` on a free port of this machine, which ends with this process, whatever becomes of it."""

    def __init__(self, data: Optional[PathLike] = None, *, program: Optional[PathLike] = None,
                 flags: Sequence[str] = (), address: str = "127.0.0.1:0") -> None:
        program = _find(program)
        self._own = None if data is not None else tempfile.TemporaryDirectory(prefix="shapedb-")
        self.data = Path(self._own.name, "data") if self._own is not None else Path(os.fspath(data or ""))
        """The data directory."""
        self._log = tempfile.NamedTemporaryFile(prefix="shapedb-", suffix=".log")
        self._process: Optional["subprocess.Popen[str]"] = None
        self._banner = ""
        self.address = ""
        """HOST:PORT."""
        self._started = threading.Event()
        command = [program, "--data", os.fspath(self.data), "--listen", address, *flags]
        # When the thread that started it ends, the kernel stops the server (setpriv is part of every Debian): this
        # thread ends only after the server, or with the process.
        self._thread = threading.Thread(target=self._run, args=(_guarded(command),), name="shapedbd", daemon=True)
        self._thread.start()
        self._started.wait()
        atexit.register(self.stop)
        if not self._banner.startswith("listening on "):
            log = self.log()
            self.stop()
            raise ShapeDBError("unavailable", f"the server did not start: {log.strip() or 'see its program'}")
        self.address = self._banner[len("listening on "):].strip()

    def _run(self, command: List[str]) -> None:
        # What the environment says of servers is said of others.
        environment = {name: value for name, value in os.environ.items() if not name.startswith("SHAPEDB_")}
        try:
            # A session of its own: Ctrl-C is for this program, which stops the server in its own time.
            self._process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                                             stderr=self._log, text=True, start_new_session=True,
                                             env=environment)
        except OSError as error:
            self._log.write(f"{command[0]} cannot be run: {error.strerror}".encode())
            self._log.flush()
            self._started.set()
            return
        assert self._process.stdout is not None
        self._banner = self._process.stdout.readline()
        self._started.set()
        self._process.wait()

    def log(self) -> str:
        """What the server has logged."""
        return Path(self._log.name).read_text(errors="replace") if os.path.exists(self._log.name) else ""

    @property
    def running(self) -> bool:
        """Whether it runs."""
        return self._process is not None and self._process.poll() is None

    def stop(self) -> None:
        """Lets it finish what it does, and stops it. Data in a directory of its own are deleted."""
        atexit.unregister(self.stop)
        process = self._process
        if process is not None:
            if self.running:
                process.terminate()
            self._thread.join(_STOP_SECONDS)
            if self.running:
                process.kill()
                self._thread.join()
            if process.stdout is not None:
                process.stdout.close()
        self._log.close()
        if self._own is not None:
            self._own.cleanup()

    def __enter__(self) -> "LocalServer":
        return self

    def __exit__(self, *error: object) -> None:
        self.stop()

    def __repr__(self) -> str:
        return f"<LocalServer at {self.address}, data in {self.data}{'' if self.running else ', stopped'}>"


def _guarded(command: List[str]) -> List[str]:
    setpriv = shutil.which("setpriv")
    return command if setpriv is None else [setpriv, "--pdeathsig", "TERM", *command]


def _find(program: Optional[PathLike]) -> str:
    name = os.fspath(program) if program is not None else os.environ.get("SHAPEDBD") or "shapedbd"
    found = shutil.which(name)
    if found is None:
        raise ShapeDBError("file_not_readable", f"no program {name}: build shapedbd (scripts/build.sh) and name it "
                           "with program=..., the variable SHAPEDBD, or a folder on the PATH")
    return found


class LocalClient(Client):
    """A client with a server of its own, which stops when the client is closed."""

    def __init__(self, server: LocalServer, *, timeout: Optional[float] = 60.0,
                 retry: RetryPolicy = RetryPolicy()) -> None:
        nothing: Mapping[str, str] = {}
        super().__init__(server.address, timeout=timeout, retry=retry, environment=nothing)
        self.server = server

    def close(self) -> None:
        """Ends the connection, and stops the server."""
        super().close()
        self.server.stop()


def local(data: Optional[PathLike] = None, *, program: Optional[PathLike] = None, flags: Sequence[str] = (),
          timeout: Optional[float] = 60.0) -> LocalClient:
    """Starts a server on a free port and connects to it: for notebooks, scripts and tests.

    The data are kept in the folder `data`, to be used again, or in one that is deleted when the client is closed.
    `program` is the server, `shapedbd`; by default the variable SHAPEDBD names it, or it is found on the PATH. `flags`
    are more of its flags. The server ends with `close()`, with a `with` block, or with this process. Its log is
    `client.server.log()`.
    """
    return LocalClient(LocalServer(data, program=program, flags=flags), timeout=timeout)
