# SPDX-License-Identifier: GPL-3.0-or-later
"""scripts/documented-commands.py itself: that it finds what a page says wrongly."""

import importlib.util
import os
import sys
import tempfile
import unittest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.path.insert(0, os.path.join(ROOT, "scripts"))
spec = importlib.util.spec_from_file_location("documented_commands", os.path.join(ROOT, "scripts/documented-commands.py"))
commands = importlib.util.module_from_spec(spec)
spec.loader.exec_module(commands)


def run(text, times=False):
    """A page of this text, run without a server; what was found, and what the page would be."""
    with tempfile.TemporaryDirectory(prefix="shapedb-docs-") as folder:
        page = os.path.join(folder, "page.md")
        with open(page, "w", encoding="utf-8") as file:
            file.write(text)
        work = os.path.join(folder, "work")
        os.mkdir(work)
        session = commands.Session(work, ("127.0.0.1:41", "127.0.0.1:42"))
        check = commands.Check(os.path.relpath(page, ROOT), times)
        try:
            check.run(session)
        finally:
            session.close()
        check.write()
        with open(page, encoding="utf-8") as file:
            return check.differing, check.ran, file.read()


class Running(unittest.TestCase):
    def test_compares_what_is_printed(self):
        self.assertEqual(run("```\n$ echo one\none\n$ echo two\ntwo\n```\n")[:2], (0, 2))
        self.assertEqual(run("```\n$ echo 0.940\n0.938\n```\n"), (1, 1, "```\n$ echo 0.940\n0.940\n```\n"))
        self.assertEqual(run("```\n$ echo more; echo than shown\nmore\n```\n")[0], 1)
        self.assertEqual(run("```\n$ true\nsomething\n```\n")[0], 1)

    def test_lets_times_and_sizes_differ(self):
        page = "```\n$ echo 'in 12 ms, 3.4 MiB'\nin 5 s, 1.0 KiB\n```\n"
        self.assertEqual(run(page), (0, 1, page))
        self.assertIn("in 12 ms, 3.4 MiB\n```", run(page, times=True)[2])
        self.assertEqual(run("```\n$ echo 12 parts\n13 parts\n```\n")[0], 1)

    def test_lets_three_points_stand_for_any_lines(self):
        self.assertEqual(run("```\n$ seq 1 9\n1\n...\n9\n```\n")[0], 0)
        self.assertEqual(run("```\n$ seq 1 9\n1\n...\n8\n```\n")[0], 1)

    def test_is_one_session(self):
        self.assertEqual(run("```\n$ export A=7; cd /\n```\n\ntext\n\n```\n$ echo $A $PWD\n7 /\n```\n")[0], 0)
        self.assertEqual(run("<!-- setup: echo 5 > file -->\n```\n$ cat file\n5\n```\n")[0], 0)
        self.assertEqual(run("```python\nx = 4\n```\n\n```python\nprint(x)\n```\n\n<!-- output -->\n```text\n4\n```\n")[0], 0)

    def test_shows_the_addresses_of_the_page(self):
        self.assertEqual(run("```\n$ echo 127.0.0.1:7878 $SHAPEDB_SERVER\n127.0.0.1:7878 127.0.0.1:7878\n```\n")[0], 0)

    def test_notices_what_fails(self):
        self.assertEqual(run("```python\n1 / 0\n```\n")[:2], (1, 1))
        self.assertEqual(run("```sh\nfalse\ntrue\n```\n")[:2], (1, 1))
        self.assertEqual(run("```python\nprint(1)\n```\n\n<!-- output -->\n```text\n2\n```\n")[0], 1)

    def test_leaves_what_is_marked(self):
        self.assertEqual(run("<!-- not run: it would fail for a good reason -->\n```sh\nfalse\n```\n")[:2], (0, 0))

    def test_waits_for_what_is_started(self):
        self.assertEqual(run("```\n$ (sleep 0.3; echo up) &\nup\n$ kill %1 2> /dev/null; echo down\ndown\n```\n")[0], 0)


if __name__ == "__main__":
    unittest.main()
