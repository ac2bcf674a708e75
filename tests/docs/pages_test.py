# SPDX-License-Identifier: GPL-3.0-or-later
"""What must be true of the pages without running them."""

import os
import re
import subprocess
import sys
import unittest

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
sys.path.insert(0, os.path.join(ROOT, "scripts"))

from documented_pages import blocks_of, commands_of, not_run, pages, read  # noqa: E402

# Blocks of commands that nobody runs, by page; each says why. Run what can be run; what cannot is counted here.
NOT_RUN = {
    "README.md": 2,     "docs/benchmarks.md": 7, "docs/command-line.md": 1, "docs/development.md": 5, "docs/fit.md": 1,
    "docs/install.md": 6, "docs/operations.md": 2, "docs/other-languages.md": 1, "docs/python.md": 1, "docs/reliability.md": 1,
    "docs/retrieval.md": 5, "docs/security.md": 6, "docs/storage.md": 2, "docs/tutorial.md": 1, "docs/verify.md": 2,
    "docs/views.md": 1, "docs/web.md": 1,
}


def names_of_errors():
    """Those of core/base/error.h, as errorCodeName writes them."""
    with open(os.path.join(ROOT, "core/base/error.h"), encoding="utf-8") as file:
        codes = re.search(r"enum class ErrorCode \{(.*?)\n\};", file.read(), re.DOTALL).group(1)
    return [re.sub(r"(?<!^)([A-Z])", r"_\1", code).lower() for code in re.findall(r"^\s+k(\w+),", codes, re.MULTILINE)]


class Pages(unittest.TestCase):
    def test_every_page_is_in_the_navigation_once(self):
        listed = re.findall(r"(?:: |- )([\w-]+\.md)$", read("mkdocs.yml"), re.MULTILINE)
        self.assertEqual(sorted(listed), sorted(os.path.basename(page) for page in pages() if page.startswith("docs/")))

    def test_troubleshooting_has_every_error(self):
        names = names_of_errors()
        self.assertGreater(len(names), 30)
        page = read("docs/troubleshooting.md")
        rows = re.findall(r"^\| `(\w+)` \| ([^|]+) \| ([^|]+) \|$", page[page.index("## Errors by name"):], re.MULTILINE)
        self.assertEqual(sorted(name for name, *_ in rows), sorted(names), "one row each")

    def test_troubleshooting_quotes_what_the_programs_say(self):
        page = read("docs/troubleshooting.md")
        cells = re.findall(r"^\| (`[^|]+) \|", page[:page.index("## Errors by name")], re.MULTILINE)
        quoted = [message for cell in cells for message in re.findall(r"`([^`]{15,})`", cell)]
        self.assertGreater(len(quoted), 24)
        said = ""
        for folder in ("client", "server", "core", "common"):
            for place, _, files in os.walk(os.path.join(ROOT, folder)):
                for name in files:
                    if name.endswith((".cpp", ".h")) and "node_modules" not in place:
                        with open(os.path.join(place, name), encoding="utf-8") as file:
                            said += re.sub(r'"\s*"', "", file.read()).replace('\\"', '"')
        for message in quoted:
            for piece in re.split(r"'?\.\.\.'?|\b\d+\b|'\w+'|\bSHAPEDB_|[;?]", message):
                piece = piece.strip(" ,:'")
                if len(piece) > 8 and piece != "shapedb: command not found":
                    self.assertTrue(piece in said, f"nobody says '{piece}' ({message})")

    def test_concepts_explain_every_reason_of_a_score(self):
        table = re.search(r"kStatistics.*?\n\}", read("core/signature/statistics.h"), re.DOTALL).group(0)
        names = re.findall(r'\{"([a-z ]+)", \d', table)
        self.assertEqual(len(names), 11)
        page = read("docs/concepts.md")
        rows = re.findall(r"^\| ([a-z ]+) \| [^|]+ \|$", page[page.index("## Reasons"):page.index("## Views")], re.MULTILINE)
        self.assertEqual(sorted(set(rows) - {"reason"}), sorted([*names, "fit", "parts", "contained parts"]))

    def test_the_api_reference_is_what_proto_says(self):
        done = subprocess.run([sys.executable, os.path.join(ROOT, "scripts/api-reference.py")], stderr=subprocess.PIPE, text=True)
        self.assertEqual(done.returncode, 0, done.stderr)

    def test_pictures_are_small_and_used(self):
        folder = os.path.join(ROOT, "docs/images")
        text = "".join(read(page) for page in pages())
        for name in os.listdir(folder):
            self.assertLess(os.path.getsize(os.path.join(folder, name)), 220_000, name)
            self.assertIn("images/" + name, text, "nobody shows it")

    def test_links_between_pages_lead_to_files(self):
        for page in pages():
            for target in re.findall(r"\]\(([^)#\s]+)(?:#[^)\s]*)?\)", re.sub(r"```.*?```", "", read(page), flags=re.DOTALL)):
                if not re.match(r"[a-z]+:", target):
                    path = os.path.normpath(os.path.join(ROOT, os.path.dirname(page), target))
                    self.assertTrue(os.path.exists(path), f"{page}: {target}")


class Figures(unittest.TestCase):
    """Figures that several pages show are those of the page that measures them."""

    def test_of_retrieval(self):
        measured = dict(re.findall(r"^\| `(models[\w.-]*)` \|[^|]*\| ([\d.]+ / [\d.]+) \|", read("docs/retrieval.md"), re.MULTILINE))
        self.assertEqual(len(measured), 3)
        for value in measured.values():
            self.assertIn(f"**{value}**", read("README.md"))
            self.assertIn(f"**{value}**", read("docs/comparison.md"))
            self.assertIn("| " + value.replace(" / ", " | ") + " |", read("docs/choosing-parameters.md"))

    def test_of_what_a_score_means(self):
        """README.md and docs/concepts.md join rows of the table of docs/verify.md."""
        row = r"^\| (below )?([\d.]+)(?: to ([\d.]+))? \|"
        measured = [(0.0, float(low)) + (float(hits.replace(",", "")), *map(float, shares)) if below else
                    (float(low), float(high), float(hits.replace(",", "")), *map(float, shares))
                    for below, low, high, hits, *shares in
                    re.findall(row + r" ([\d,]+) \| ([\d.]+) \| ([\d.]+) \| ([\d.]+) \|$", read("docs/verify.md"), re.MULTILINE)]
        self.assertEqual(len(measured), 7)
        for page in ("README.md", "docs/concepts.md"):
            rows = re.findall(row + r" \**(\d+) %\** \| \**(\d+) %\** \| \**(\d+) %\** \|$", read(page), re.MULTILINE)
            self.assertGreaterEqual(len(rows), 5, page)
            for below, low, high, *shown in rows:
                low, high = (0.0, float(low)) if below else (float(low), float(high))
                inside = [each for each in measured if low <= each[0] and each[1] <= high]
                hits = sum(each[2] for each in inside)
                for place, share in enumerate(shown):
                    mean = 100 * sum(each[2] * each[3 + place] for each in inside) / hits
                    self.assertLessEqual(abs(mean - int(share)), 0.6, f"{page}: {low} to {high}: {mean}")


class Commands(unittest.TestCase):
    def test_that_are_not_run_say_why_and_are_counted(self):
        counted = {}
        for where, reason, _ in not_run():
            self.assertGreater(len(reason.split()), 3, f"{where}: '{reason}' is no reason")
            page = where.split(":")[0]
            counted[page] = counted.get(page, 0) + 1
        self.assertEqual(counted, NOT_RUN)

    def test_are_marked(self):
        unmarked = [f"{block.where}: {block.lines[0]}" for page in pages() for block in blocks_of(page)
                    if block.kind == "unmarked" and block.not_run is None]
        self.assertEqual(unmarked, [], "`$ ` in front of each command, ```sh, or a comment that says why they are not run")

    def test_are_most_of_what_is_shown(self):
        run = sum(len(commands_of(block)) if block.kind == "console" else 1 for page in pages() for block in blocks_of(page)
                  if block.kind not in ("data", "unmarked") and block.not_run is None)
        self.assertGreater(run, 90)
        self.assertLess(len(not_run()), run / 2)

    def test_hide_in_no_data(self):
        """A block that is taken for data shows nothing that looks typed."""
        for page in pages():
            for block in blocks_of(page):
                if block.kind == "data":
                    self.assertFalse([line for line in block.lines if line.startswith("$ ")], block.where)


class Blocks(unittest.TestCase):
    """How a page is read (scripts/documented_pages.py)."""

    def kinds(self, text):
        return [(block.kind, block.not_run) for block in blocks_of("page.md", text)]

    def test_are_told_apart(self):
        self.assertEqual(self.kinds("```\n$ shapedb list\nid\n```\n"), [("console", None)])
        self.assertEqual(self.kinds("```sh\nshapedb admin rebuild\n```\n"), [("sh", None)])
        self.assertEqual(self.kinds("```\nshapedb admin rebuild\n```\n"), [("unmarked", None)])
        self.assertEqual(self.kinds("text\n\n    shapedb list\n\ntext\n"), [("unmarked", None)])
        self.assertEqual(self.kinds("text\n\n    score = 1 / (1 + D)\n"), [("data", None)])
        self.assertEqual(self.kinds("```json\n{}\n```\n"), [("data", None)])
        self.assertEqual(self.kinds("```python\nprint(1)\n```\n"), [("python", None)])
        self.assertEqual(self.kinds("1. Do\n\n       openssl req\n\n2. Then\n"), [("unmarked", None)])

    def test_are_marked_by_the_comment_above(self):
        self.assertEqual(self.kinds("<!-- not run: takes a day and a half -->\n\n    shapedb list\n"),
                         [("unmarked", "takes a day and a half")])
        self.assertEqual(self.kinds("<!-- not run: takes a day and a half -->\ntext\n\n    shapedb list\n"), [("unmarked", None)])
        block, = blocks_of("page.md", "<!-- setup: mkdir x -->\n```\n$ ls\n```\n")
        self.assertEqual(block.setup, ["mkdir x"])

    def test_have_commands_over_several_lines(self):
        block, = blocks_of("page.md", "```\n$ curl a |\n    head\n1\n$ ls\n```\n")
        found = commands_of(block)
        self.assertEqual([(each.command, each.expected, each.line) for each in found],
                         [("curl a |\n    head", ["1"], 3), ("ls", [], 5)])


if __name__ == "__main__":
    unittest.main()
