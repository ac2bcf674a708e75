# SPDX-License-Identifier: Apache-2.0
"""The package is typed: mypy --strict finds nothing in it, nor in what its users write."""

import os
import re
import subprocess
import sys
from pathlib import Path

PACKAGE = Path(os.environ["PYTHON_PACKAGE"])
EXAMPLES = Path(__file__).resolve().parents[2] / "client/python/examples"

USER = '''
import asyncio
import numpy as np
import shapedb

async def main() -> None:
    async with shapedb.AsyncClient("localhost", timeout=3.0) as other:
        collection = other.collection("x")
        async for shape in collection.shapes(state="ready"):
            reveal_type(shape)
        reveal_type(await collection.search(np.zeros((5, 3))))

with shapedb.Client() as client:
    collection = client.create_collection("x", unit="mm")
    added = collection.add("key", [[0.0, 1.0, 2.0]], metadata={"a": 1})
    reveal_type(added.outcome)
    result = collection.search("scan.ply", k=3)
    for hit in result:
        reveal_type(hit.why)
        reveal_type(hit.motion)
    reveal_type(result[0])
    reveal_type(result[:2])
    collection.add("key", 3, mode="overwrite")
    client.create_collection("x", unit="furlong")
'''


def mypy(*files):
    cache = PACKAGE / "mypy-cache"
    run = subprocess.run([sys.executable, "-m", "mypy", "--config-file", str(PACKAGE / "pyproject.toml"), "--strict",
                          "--cache-dir", str(cache), *map(str, files)], capture_output=True, text=True,
                         env={**os.environ, "MYPYPATH": str(PACKAGE / "src")})
    return run.stdout + run.stderr


def test_nothing_is_found_in_the_package_and_the_examples():
    found = mypy(PACKAGE / "src/shapedb", *sorted(EXAMPLES.glob("*.py")))
    assert "Success: no issues found" in found, found


def test_users_are_told_types_and_mistakes(tmp_path):
    program = tmp_path / "program.py"
    program.write_text(USER)
    found = mypy(program)
    revealed = re.findall(r'Revealed type is "(.*)"', found)
    assert [name.replace("shapedb._types.", "").replace("shapedb._search_types.", "") for name in revealed] == [
        "Shape", "SearchResult",
        "Union[Literal['created'], Literal['replaced'], Literal['metadata_changed'], Literal['unchanged'], "
        "Literal['retried']]",
        "Union[Why, None]", "Union[numpy.ndarray[Any, numpy.dtype[numpy.floating[numpy._typing._64Bit]]], None]", "Hit",
        "builtins.tuple[Hit, ...]"], found
    mistakes = re.findall(r"error: (.*)", found)
    assert len(mistakes) == 2 and "mode" in mistakes[0] and "unit" in mistakes[1], found
