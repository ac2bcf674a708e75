#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Makes the client that blocks of the one for asyncio: client/python/src/shapedb/_async_*.py -> _*.py.

  scripts/python-sync.py            fails if they do not agree
  scripts/python-sync.py --update   writes them

Both have the same calls; what differs is in _transport.py and the workers of _bulk.py.
"""

import difflib
import pathlib
import re
import sys

FOLDER = pathlib.Path(__file__).resolve().parent.parent / "client/python/src/shapedb"
FILES = ("client", "collection")

RULES = (
    (r"\basync (def|for|with) ", r"\1 "),
    (r"\bawait ", ""),
    (r"__aenter__", "__enter__"),
    (r"__aexit__", "__exit__"),
    (r"\bAsyncIterator\b", "Iterator"),
    (r"\bAsync(Client|Collection|Transport)\b", r"\1"),
    (r"\b_async_(client|collection)\b", r"_\1"),
    (r"\brun_async_workers\b", "run_workers"),
    (r'(?m:^)"""A connection for asyncio\..*?"""\n', '"""A connection that blocks. Made of `_async_client.py` by '
     'scripts/python-sync.py: change that, not this."""\n'),
    (r'(?m:^)"""One collection, as `Client` sees it\..*?"""\n', '"""One collection, for `Client`. Made of '
     '`_async_collection.py` by scripts/python-sync.py: change that, not this."""\n'),
)


def sync(text):
    for pattern, replacement in RULES:
        text = re.sub(pattern, replacement, text, flags=re.DOTALL)
    return text


def main():
    update = sys.argv[1:] == ["--update"]
    agree = True
    for name in FILES:
        made = sync((FOLDER / f"_async_{name}.py").read_text())
        path = FOLDER / f"_{name}.py"
        if update:
            path.write_text(made)
        elif not path.exists() or path.read_text() != made:
            agree = False
            old = path.read_text() if path.exists() else ""
            sys.stderr.writelines(list(difflib.unified_diff(old.splitlines(True), made.splitlines(True), str(path),
                                                            "as it should be", n=0))[:20])
    return 0 if agree else 1


sys.exit(main())
