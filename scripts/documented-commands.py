#!/usr/bin/env python3
"""Runs the commands that the documentation shows, and compares what they print with what it says they print.

  scripts/documented-commands.py [--update] [--times] [PAGE...]    docs/command-line.md, and README.md with SHAPEDB_DATA

Every line `$ shapedb ...` of a block fenced by ``` is run, page by page from top to bottom, in an empty folder and
against a new server; the lines below it are the expected output. A line `...` there stands for any lines. A comment
`<!-- setup: COMMAND -->` in front of a block runs a command that the page does not show. README.md finds the folders
of SHAPEDB_DATA (docs/data.md). Times, sizes in bytes, addresses, cursors and the width of columns may differ.
`--update` writes what has changed into the pages, `--times` also what may differ. The programs are those in BUILD_DIR/bin [build/bin].
"""

import argparse
import difflib
import os
import re
import subprocess
import sys
import tempfile

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
BIN = os.path.join(ROOT, os.environ.get("BUILD_DIR", "build"), "bin")
ADDRESS = "127.0.0.1:7878"  # that the pages show
SECONDS = 900  # for one command
ANY = "..."

# What differs from run to run.
VARYING = [
    (re.compile(r"(?<![\w.])\d[\d.]*(e[-+]?\d+)? (ns|us|ms|s|min|h)(?!\w)"), "<time>"),
    (re.compile(r"(?<![\w.])\d[\d.]* ([KMG]i)?B(?!\w)"), "<bytes>"),
    (re.compile(r"--cursor \w+"), "--cursor <cursor>"),
    (re.compile(r" +"), " "),
]


class Server:
    """shapedbd on a free port, with its data in `folder`."""

    def __init__(self, folder):
        self.process = subprocess.Popen(
            [os.path.join(BIN, "shapedbd"), "--listen", "127.0.0.1:0", "--data", folder],
            stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        banner = self.process.stdout.readline().strip()
        if not banner.startswith("listening on "):
            sys.exit("documented-commands: the server did not start")
        self.address = banner[len("listening on "):]

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.terminate()
        self.process.wait()
        self.process.stdout.close()


class Shown:
    """A command and the lines of the page that are its output."""

    def __init__(self, line, command):
        self.line = line  # of the command, from 0
        self.command = command
        self.setup = []
        self.expected = []


def commands_of(lines):
    """The commands of a page, in order."""
    found = []
    setup = []
    in_block = False
    current = None
    for number, line in enumerate(lines):
        if line.startswith("```"):
            in_block = not in_block
            current = None
        elif not in_block:
            comment = re.fullmatch(r"<!-- setup: (.*) -->", line)
            if comment:
                setup.append(comment.group(1))
        elif line.startswith("$ shapedb "):
            current = Shown(number, line[2:])
            current.setup, setup = setup, []
            found.append(current)
        elif line.startswith("$ "):
            current = None
        elif current is not None:
            current.expected.append(line)
    return found


def run(command, folder, server):
    environment = {**os.environ, "PATH": BIN + os.pathsep + os.environ["PATH"], "SHAPEDB_SERVER": server.address}
    done = subprocess.run(["bash", "-c", command], cwd=folder, env=environment, stdin=subprocess.DEVNULL,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=SECONDS)
    return done.stdout.replace(server.address, ADDRESS).rstrip("\n").split("\n"), done.returncode


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


def check(page, update, times):
    """Runs a page; the number of commands that print something else than it says."""
    with open(page, encoding="utf-8") as file:
        lines = file.read().split("\n")
    name = os.path.relpath(page, ROOT)
    changes = []
    differing = 0
    with tempfile.TemporaryDirectory(prefix="shapedb-docs-") as folder:
        work = os.path.join(folder, "work")
        os.mkdir(work)
        data = os.environ.get("SHAPEDB_DATA")
        if name == "README.md":
            for entry in os.listdir(data):
                os.symlink(os.path.join(os.path.abspath(data), entry), os.path.join(work, entry))
        with Server(os.path.join(folder, "data")) as server:
            for shown in commands_of(lines):
                for command in shown.setup:
                    output, code = run(command, work, server)
                    if code != 0:
                        sys.exit(f"{name}:{shown.line + 1}: setup failed: {command}\n" + "\n".join(output))
                print(f"{name}:{shown.line + 1}: $ {shown.command}", flush=True)
                printed, _ = run(shown.command, work, server)
                same = agree(shown.expected, printed)
                if not same or times:
                    changes.append((shown, printed))
                differing += 0 if same else 1
                if same:
                    continue
                print("\n".join(difflib.unified_diff(masked(shown.expected), masked(printed), "documented", "printed",
                                                     lineterm="", n=1)))
    if update:
        for shown, printed in reversed(changes):
            begin = shown.line + 1
            lines[begin:begin + len(shown.expected)] = updated(shown.expected, printed, times)
        with open(page, "w", encoding="utf-8") as file:
            file.write("\n".join(lines))
    return differing


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--update", action="store_true", help="write what has changed into the pages")
    parser.add_argument("--times", action="store_true", help="with --update: write times and sizes too")
    parser.add_argument("pages", nargs="*", metavar="PAGE")
    arguments = parser.parse_args()
    pages = arguments.pages or ["docs/command-line.md"] + (["README.md"] if os.environ.get("SHAPEDB_DATA") else [])
    differing = sum(check(os.path.join(ROOT, page), arguments.update, arguments.times) for page in pages)
    if differing == 0:
        print("documented-commands: the pages say what the commands print")
    else:
        print(f"documented-commands: {differing} commands print something else than the pages say", file=sys.stderr)
    return 0 if differing == 0 or arguments.update else 1


if __name__ == "__main__":
    sys.exit(main())
