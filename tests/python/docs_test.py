# SPDX-License-Identifier: Apache-2.0
"""docs/python.md and the notebook run as they are written."""

import json
import os
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


def run(blocks, folder, monkeypatch):
    monkeypatch.chdir(folder)
    names = {"__name__": "__main__"}
    for number, (where, block) in enumerate(blocks):
        exec(compile(block, where, "exec"), names)
    return names


def test_the_page_runs(tmp_path, monkeypatch, capsys):
    pytest.importorskip("pandas")
    pytest.importorskip("matplotlib")
    page = (ROOT / "docs/python.md").read_text()
    blocks = [(f"docs/python.md, line {page[:match.start()].count(chr(10)) + 2}", match.group(1))
              for match in re.finditer(r"^```python\n(.*?)^```$", page, flags=re.MULTILINE | re.DOTALL)]
    assert len(blocks) >= 9
    assert len([line for line in blocks[0][1].splitlines() if line]) <= 10, "the start has ten lines"
    names = run(blocks, tmp_path, monkeypatch)
    printed = capsys.readouterr().out
    for words in ("egg", "same_object", "invalid_argument - the scan has shape (3, 100)", "point 0 is (0, 0, nan)",
                  "created\nready", "['plank']", "6 new, 0 failed", "rank  score", "plank: same object", "not_found",
                  "box/0"):
        assert words in printed, words
    assert (tmp_path / "overlay.png").exists() and names["result"][0].key == "plank"


def test_the_notebook_runs(tmp_path, monkeypatch):
    pytest.importorskip("pandas")
    pytest.importorskip("matplotlib").use("Agg")
    notebook = json.loads((ROOT / "client/python/examples/tour.ipynb").read_text())
    assert notebook["nbformat"] == 4
    assert not [cell for cell in notebook["cells"] if cell.get("outputs")], "outputs are not checked in"
    blocks = [(f"tour.ipynb, cell {number}", "".join(cell["source"])) for number, cell in enumerate(notebook["cells"])
              if cell["cell_type"] == "code"]
    names = run(blocks, tmp_path, monkeypatch)
    assert names["result"][0].label == "desk" and len(names["tables"].name) > 0
    assert not names["client"].server.running


def test_what_the_page_names_is_there():
    page = (ROOT / "docs/python.md").read_text()
    for example in re.findall(r"^\| `(\w+\.(?:py|ipynb))", page, flags=re.MULTILINE):
        assert (ROOT / "client/python/examples" / example).exists(), example
    listed = set(re.findall(r"^\| `(\w+\.(?:py|ipynb))", page, flags=re.MULTILINE))
    assert listed == {name for name in os.listdir(ROOT / "client/python/examples") if not name.startswith("__")}
