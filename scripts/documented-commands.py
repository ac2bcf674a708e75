#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Runs what the documentation tells people to type, and compares what is printed with what the pages say.

  scripts/documented-commands.py [--update] [--times] [PAGE...]    README.md and all of docs/
  scripts/documented-commands.py --list                            which blocks are not run, and why

Each page is run from top to bottom, in an empty folder, by one shell, with a new server unless the page starts its own.
scripts/documented_pages.py says what of a page is run and how blocks are marked. Pages that need the public scans of
docs/data.md find them in their folder if SHAPEDB_DATA is set, and are left out otherwise. Times, sizes in bytes, addresses,
cursors, dates, checksums and the width of columns may differ. `--update` writes what has changed into the pages, `--times`
also what may differ. The programs are those in BUILD_DIR/bin [build/bin].
"""

import argparse
import difflib
import json
import os
import queue
import re
import shlex
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
import uuid

from documented_pages import ROOT, blocks_of, commands_of, needs_data, not_run, pages, read

BUILD = os.path.join(ROOT, os.environ.get("BUILD_DIR", "build"))
BIN = os.path.join(BUILD, "bin")
PYTHON = "/usr/bin/python3"  # Debian's packages belong to this one
GRPC, HTTP = "127.0.0.1:7878", "127.0.0.1:7879"  # that the pages show
SECONDS = 1800  # for one command
ANY = "..."

# What differs from run to run.
VARYING = [
    (re.compile(r"\d{4}-\d\d-\d\dT[\d:.]+Z"), "<date>"),
    (re.compile(r"(?<![\w.])\d[\d.]*(e[-+]?\d+)? (ns|us|ms|s|min|h)(?!\w)"), "<time>"),
    (re.compile(r"(\"?seconds\w*\"?: ?)[\d.e-]+"), r"\1<time>"),
    (re.compile(r"(?<![\w.])\d[\d.]* ([KMG]i)?B(?!\w)"), "<bytes>"),
    (re.compile(r"(?<![\w.,])\d{4,} bytes"), "<bytes>"),
    (re.compile(r"--cursor \w+"), "--cursor <cursor>"),
    (re.compile(r"(?<!\w)[0-9a-f]{16,}(?!\w)"), "<hex>"),
    (re.compile(r" +"), " "),
]

# Runs blocks of Python one after the other, with the same names.
PYTHON_LOOP = r"""
import json, sys, traceback
names = {"__name__": "__main__"}
for line in sys.stdin:
    block = json.loads(line)
    code = 0
    try:
        exec(compile(block["text"], block["where"], "exec"), names)
    except BaseException:
        code = 1
        traceback.print_exc(file=sys.stdout)
    print("\n" + block["token"], code, flush=True)
"""


class Talk:
    """A program that is told what to do line by line, and says with a token that it has done it."""

    def __init__(self, arguments, folder, environment):
        self.process = subprocess.Popen(arguments, cwd=folder, env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                        stderr=subprocess.STDOUT, text=True, errors="replace",
                                        start_new_session=True)
        self.lines = queue.Queue()
        self.reader = threading.Thread(target=self._read, daemon=True)
        self.reader.start()

    def _read(self):
        for line in self.process.stdout:
            self.lines.put(line.rstrip("\n"))
        self.lines.put(None)

    def line(self, seconds):
        """The next line; None at the end, or if it does not come in time."""
        try:
            return self.lines.get(timeout=seconds)
        except queue.Empty:
            return None

    def ask(self, text, token):
        """What it prints until the token, and the number behind the token."""
        self.process.stdin.write(text)
        self.process.stdin.flush()
        printed = []
        end = time.monotonic() + SECONDS
        while True:
            line = self.line(end - time.monotonic())
            if line is None:
                return printed + ["(it ended, or took too long)"], -1
            if line.startswith(token):
                return printed[:-1] if printed and not printed[-1] else printed, int(line.split()[1])
            printed.append(line)

    def close(self, farewell):
        try:
            self.process.stdin.write(farewell)
            self.process.stdin.close()
            self.process.wait(60)
        except (OSError, subprocess.TimeoutExpired):
            os.killpg(self.process.pid, signal.SIGKILL)  # its own session: only what it has started
            self.process.wait()
        self.reader.join(10)
        self.process.stdout.close()


class Session:
    """The reader: one folder, one shell, one Python."""

    def __init__(self, folder, addresses):
        self.folder = folder
        self.addresses = addresses  # what the page calls GRPC and HTTP
        self.environment = {
            **os.environ, "PATH": BIN + os.pathsep + os.environ["PATH"], "SHAPEDB_SERVER": addresses[0],
            "SHAPEDB": "http://" + addresses[1], "SHAPEDBD": os.path.join(BIN, "shapedbd"), "MPLBACKEND": "Agg",
            "PYTHONPATH": os.path.join(BUILD, "python", "src"), "PROTO_FOLDER": os.path.join(ROOT, "proto"), "SHAPEDB_LISTEN": addresses[0], "COLUMNS": "200"}
        self.shell = Talk(["bash", "--noprofile", "--norc"], folder, self.environment)
        self.python = None

    def here(self, text):
        return text.replace(GRPC, self.addresses[0]).replace(HTTP, self.addresses[1])

    def as_documented(self, lines):
        return [line.replace(self.addresses[0], GRPC).replace(self.addresses[1], HTTP) for line in lines]

    def run(self, command, lines_expected=0):
        token = "done-" + uuid.uuid4().hex
        printed, code = self.shell.ask(f"eval {shlex.quote(self.here(command))} </dev/null\nprintf '\\n%s %s\\n' {token} $?\n",
                                       token)
        if command.rstrip().endswith("&"):  # what it starts says so in its own time
            while len(printed) < max(lines_expected, 1):
                line = self.shell.line(60)
                if line is None:
                    break
                printed.append(line)
        return self.as_documented(printed), code

    def run_python(self, block):
        if self.python is None:
            self.python = Talk([PYTHON, "-u", "-c", PYTHON_LOOP], self.folder, self.environment)
        token = "done-" + uuid.uuid4().hex
        text = json.dumps({"text": self.here("\n".join(block.lines) + "\n"), "where": block.where, "token": token})
        printed, code = self.python.ask(text + "\n", token)
        return self.as_documented(printed), code

    def run_js(self, block):
        name = f"block-{block.line}.mjs"
        with open(os.path.join(self.folder, name), "w", encoding="utf-8") as file:
            file.write("\n".join(block.lines) + "\n")
        try:
            return self.run("node " + name)
        finally:
            os.remove(os.path.join(self.folder, name))

    def close(self):
        if self.python is not None:
            self.python.close("")
        self.shell.close("kill $(jobs -p) 2>/dev/null; wait; exit\n")


class Server:
    """shapedbd on free ports, with its data in `folder`."""

    def __init__(self, folder):
        self.process = subprocess.Popen(
            [os.path.join(BIN, "shapedbd"), "--listen", "127.0.0.1:0", "--http-listen", "127.0.0.1:0", "--data", folder],
            stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        banners = [self.process.stdout.readline().strip() for _ in range(2)]
        if not banners[1].startswith("http on http://"):
            sys.exit("documented-commands: the server did not start")
        self.addresses = (banners[0][len("listening on "):], banners[1][len("http on http://"):])

    def close(self):
        self.process.terminate()
        self.process.wait()
        self.process.stdout.close()


def free_addresses():
    sockets = [socket.create_server(("127.0.0.1", 0)) for _ in range(2)]
    addresses = tuple(f"127.0.0.1:{each.getsockname()[1]}" for each in sockets)
    for each in sockets:
        each.close()
    return addresses


def masked(lines):
    text = []
    for line in lines:
        for pattern, name in VARYING:
            line = pattern.sub(name, line)
        text.append(line.rstrip())
    while text and not text[-1]:
        text.pop()
    return text


def agree(expected, printed):
    expected, printed = masked(expected), masked(printed)
    if ANY not in expected:
        return expected == printed
    at = expected.index(ANY)
    tail = expected[at + 1:]
    return (len(printed) >= at + len(tail) and expected[:at] == printed[:at]
            and tail == printed[len(printed) - len(tail):])


def updated(expected, printed, times):
    """What the page should say: without `times` lines that only differ in what may vary stay."""
    if ANY in expected:
        at = expected.index(ANY)
        return updated(expected[:at], printed[:at], times) + expected[at:]
    if times:
        return printed
    before, after = masked(expected), masked(printed)
    result = []
    for kind, i, j, k, l in difflib.SequenceMatcher(None, before, after, autojunk=False).get_opcodes():
        result += expected[i:j] if kind == "equal" else printed[k:l]
    return result


class Check:
    """Runs one page and remembers where it is wrong."""

    def __init__(self, page, times):
        self.page = page
        self.times = times
        self.changes = []  # (line, number of lines there, what should be there)
        self.differing = 0
        self.ran = 0

    def outputs(self, where, line, expected, printed):
        same = agree(expected, printed)
        if not same or self.times:
            self.changes.append((line, len(expected), updated(expected, printed, self.times)))
        if not same:
            self.differing += 1
            print("\n".join(difflib.unified_diff(masked(expected), masked(printed), "documented", "printed", lineterm="", n=1)))

    def failed(self, where, printed, code):
        self.differing += 1
        print(f"{where}: it failed ({code}):\n" + "\n".join(printed[-20:]))

    def console(self, session, block):
        for shown in commands_of(block):
            print(f"{self.page}:{shown.line}: $ {shown.command}", flush=True)
            printed, _ = session.run(shown.command, len(shown.expected))
            self.ran += 1
            while len(shown.expected) > 1 and not shown.expected[-1]:
                shown.expected.pop()
            self.outputs(block.where, shown.line, shown.expected, printed)

    def script(self, session, block, output):
        print(f"{block.where}: {block.kind}: {block.lines[0]}", flush=True)
        if block.kind == "python":
            printed, code = session.run_python(block)
        elif block.kind == "js":
            printed, code = session.run_js(block)
        else:
            printed, code = session.run("( set -e\n" + "\n".join(block.lines) + "\n)")
        self.ran += 1
        if code != 0:
            self.failed(block.where, printed, code)
        elif output is not None:
            self.outputs(output.where, output.line, output.lines, printed)

    def run(self, session):
        blocks = blocks_of(self.page)
        for block, following in zip(blocks, blocks[1:] + [None]):
            for command in block.setup:
                printed, code = session.run(command)
                if code != 0:
                    sys.exit(f"{block.where}: setup failed: {command}\n" + "\n".join(printed))
            if block.not_run is not None or block.kind in ("data", "unmarked"):
                continue
            if block.kind == "console":
                self.console(session, block)
            elif block.kind == "js" and shutil.which("node") is None:
                print(f"{block.where}: left out: there is no Node here")
            else:
                self.script(session, block, following if following is not None and following.is_output else None)

    def write(self):
        lines = read(self.page).split("\n")
        for line, count, text in sorted(self.changes, reverse=True):
            lines[line:line + count] = text
        with open(os.path.join(ROOT, self.page), "w", encoding="utf-8") as file:
            file.write("\n".join(lines))


def is_run(page):
    return any(block.setup or (block.not_run is None and block.kind not in ("data", "unmarked")) for block in blocks_of(page))


def starts_a_server(page):
    return any(re.match(r"shapedbd .*&$", shown.command) for block in blocks_of(page)
               if block.kind == "console" and block.not_run is None for shown in commands_of(block))


def check(page, update, times):
    """Runs a page; how many commands print something else than it says, and how many there are."""
    with tempfile.TemporaryDirectory(prefix="shapedb-docs-") as folder:
        work = os.path.join(folder, "work")
        os.mkdir(work)
        if needs_data(page):
            data = os.path.abspath(os.environ["SHAPEDB_DATA"])
            for entry in os.listdir(data):
                os.symlink(os.path.join(data, entry), os.path.join(work, entry))
        server = None if starts_a_server(page) else Server(os.path.join(folder, "data"))
        session = Session(work, server.addresses if server else free_addresses())
        run = Check(page, times)
        try:
            run.run(session)
        finally:
            session.close()
            if server:
                server.close()
    if update:
        run.write()
    return run.differing, run.ran


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--update", action="store_true", help="write what has changed into the pages")
    parser.add_argument("--times", action="store_true", help="with --update: write times and sizes too")
    parser.add_argument("--list", action="store_true", help="which blocks of commands are not run, and why")
    parser.add_argument("pages", nargs="*", metavar="PAGE")
    arguments = parser.parse_args()
    if arguments.list:
        for where, reason, line in not_run():
            print(f"{where}: {reason}: {line}")
        return 0
    differing = ran = 0
    for page in arguments.pages or [page for page in pages() if is_run(page)]:
        page = os.path.relpath(os.path.abspath(page), ROOT)
        if needs_data(page) and not os.environ.get("SHAPEDB_DATA"):
            print(f"{page}: left out: SHAPEDB_DATA is not set")
            continue
        wrong, commands = check(page, arguments.update, arguments.times)
        differing += wrong
        ran += commands
    if differing == 0:
        print(f"documented-commands: {ran} commands print what the pages say")
    else:
        print(f"documented-commands: {differing} of {ran} commands print something else than the pages say", file=sys.stderr)
    return 0 if differing == 0 or arguments.update else 1


if __name__ == "__main__":
    sys.exit(main())
