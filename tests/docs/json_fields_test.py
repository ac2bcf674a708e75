# SPDX-License-Identifier: GPL-3.0-or-later
"""Every member of the JSON that the commands print is explained in docs/command-line.md."""

import json
import os
import re
import subprocess
import tempfile
import unittest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
SHAPEDB = os.environ["SHAPEDB"]
SHAPEDBD = os.environ["SHAPEDBD"]

# Exit codes of the commands that fail in part, on purpose.
EXPECTED = {words: (code,) for code, all in {
    1: [("metadata", "mug/mug_01"), ("delete", "mug/mug_02"), ("query", "--largest"),
        ("retry", "human/human_01")], 3: [("add", "--key")],
    4: [("get", "none")],
}.items() for words in all}

# Their members are data: names that somebody gave, stages, statistics.
MAPS = {"metadata", "stages", "statistics"}
# Of these the names are data, but not what they stand for.
MAPS_OF_MEMBERS = {"per_class"}


def documented():
    """What the page has in backticks, and what is quoted in its blocks of JSON."""
    with open(os.path.join(ROOT, "docs/command-line.md"), encoding="utf-8") as file:
        text = file.read()
    blocks = re.findall(r"^```.*?^```", text, flags=re.MULTILINE | re.DOTALL)
    prose = re.sub(r"^```.*?^```", "", text, flags=re.MULTILINE | re.DOTALL)
    names = {name for block in blocks for name in re.findall(r'"(\w+)":', block)}
    return names | set(re.findall(r"`(\w+)`", prose))


def members(value):
    """The names at any depth, but of maps."""
    if isinstance(value, list):
        return {name for one in value for name in members(one)}
    if not isinstance(value, dict):
        return set()
    return set(value).union(*(members(list(one.values()) if name in MAPS_OF_MEMBERS else one)
                              for name, one in value.items() if name not in MAPS))


class Fields(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory(prefix="shapedb-json-")
        cls.servers = []
        cls.address = cls.start("data", "--unix-socket", cls.path("s"))
        cls.other = cls.start("other")

    @classmethod
    def start(cls, data, *flags):
        """A server; returns its address."""
        cls.servers.append(subprocess.Popen([SHAPEDBD, "--data", cls.path(data), "--listen", "127.0.0.1:0", *flags],
                                            stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True))
        return cls.servers[-1].stdout.readline().split()[-1]

    @classmethod
    def tearDownClass(cls):
        for server in cls.servers:
            server.terminate()
            server.wait()
            server.stdout.close()
        cls.folder.cleanup()

    @classmethod
    def path(cls, name):
        return os.path.join(cls.folder.name, name)

    def run_json(self, *words, codes=(0,), server=None):
        done = subprocess.run([SHAPEDB, "--server", server or self.address, "--timeout", "100", "--json", *words],
                              capture_output=True, text=True, timeout=200, check=False)
        self.assertIn(done.returncode, codes, (words, done.stderr))
        return json.loads(done.stdout)

    def test_are_explained(self):
        known = documented()
        scans, path = self.path("scans"), self.path
        one, other = f"{scans}/human/human_01.ply", f"{scans}/human/human_02.ply"
        with open(path("junk.ply"), "w", encoding="utf-8") as file:
            file.write("ply\n")
        commands = [
            ("sample", scans, "--count", "2", "--points", "1500", "--families", "human,mug"), ("sample", "--list"),
            ("collection", "create", "c", "--units", "mm", "--description", "d"),
            ("add", scans, "--collection", "c", "--label-from-folder", "--wait", "--base", scans),
            ("add", "--key", "junk", path("junk.ply"), "--collection", "c"),
            ("collection", "get", "c"), ("collection", "list"), ("collection", "alias", "a", "c"),
            ("collection", "unalias", "a"), ("collection", "export", "c", path("c.db")),
            ("collection", "import", path("c.db"), "--name", "d"), ("collection", "rename", "d", "e"),
            ("collection", "delete", "e", "--force"), ("get", "human/human_01", "--collection", "c"),
            ("get", "human/human_01", "--collection", "c", "--out", path("o.ply")),
            ("get", "human/human_01", "--collection", "c", "--out", path("p.ply"), "--points"), ("list", "--collection", "c"),
            ("get", "human/human_01", "--collection", "c", "--out", path("q.ply"), "--preview"),
            ("list", "--collection", "c", "--limit", "1"), ("count", "--collection", "c"),
            ("count", "--collection", "c", "--by", "label"), ("watch", "mug/mug_01", "--collection", "c"),
            ("signature", "mug/mug_01", "--collection", "c"), ("query", one, "--collection", "c", "--group-by", "label"),
            ("query", "--key", "mug/mug_01", "--collection", "c", "-o", path("h.csv"), "--out-aligned", path("al")),
            ("query", "--largest", one, path("junk.ply"), "--collection", "c"),
            ("compare", "human/human_01", "human/human_02", "--collection", "c"), ("compare", one, other, "--files"),
            ("align", one, other, "-o", path("m.ply"), "--matrix", path("m.txt")),
            ("align", one, "--key", "mug/mug_01", "--collection", "c"),
            ("match", scans, scans, "-o", path("m.csv")), ("segment", one, "--out", path("s.ply"), "--largest"),
            ("evaluate", scans, "--per-class"), ("evaluate", scans + "/human", "--gallery", scans), ("duplicates", "c", "--threshold", "0.1"),
            ("report", one, "--collection", "c", "-o", path("r.html")),
            ("metadata", "mug/mug_01", "none", "--set", "x=1", "--collection", "c"),
            ("metadata", "--filter", "label=mug", "--set", "y=1", "--collection", "c"),
            ("delete", "mug/mug_02", "none", "--collection", "c"), ("delete", "--filter", "label=mug", "--yes", "--collection", "c"),
            ("retry", "human/human_01", "none", "--collection", "c"), ("health",), ("admin", "stats"), ("admin", "info"),
            ("admin", "check"), ("admin", "check", "--acknowledge"), ("admin", "rebuild", "--collection", "c"),
            ("admin", "backup", path("full.db")), ("admin", "backup", path("1.inc"), "--since", path("full.db")),
            ("admin", "merge-backups", path("full.db"), path("1.inc"), "--out", path("all.db")),
            ("admin", "restore", path("full.db"), path("1.inc")), ("get", "none", "--collection", "c"), ("help", "query"),
            ("admin", "copy", self.address, self.other, "--once"), ("metadata", "human/human_01", "--set", "x=2", "--collection", "c"),
            ("admin", "copy", self.address, self.other, "--verify"),
            ("completion", "bash"), ("man", "query"), ("man", "--out", path("man")),
        ]
        unknown = {}
        for words in commands:
            codes = (1,) if "--verify" in words else EXPECTED.get(words[:2], (0,))
            for name in members(self.run_json(*words, codes=codes)) - known:
                unknown.setdefault(name, []).append(" ".join(word for word in words[:2] if "/" not in word))
        key = self.run_json("admin", "key", "create", "--role", "reader", "--name", "n", "--valid-days", "3",
                            "--calls-per-second", "5", server="unix:" + path("s"))
        for answer in (key, self.run_json("admin", "key", "list", server="unix:" + path("s")),
                       self.run_json("admin", "key", "revoke", key.get("id", key.get("key", {}).get("id", "")),
                                     server="unix:" + path("s"), codes=range(7))):
            for name in members(answer) - known:
                unknown.setdefault(name, []).append("admin key")
        told = "\n".join(f"{name}: {', '.join(sorted(set(where)))}" for name, where in sorted(unknown.items()))
        self.assertFalse(unknown, "in JSON, but not in docs/command-line.md:\n" + told)


if __name__ == "__main__":
    unittest.main()
