#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""scripts/installed_docs.py FOLDER: the documentation as it is installed (packaging/install_docs.cmake). Of links to files that are
not installed, such as sources, the text stays."""

import os
import re
import shutil
import sys
from pathlib import Path

import site_hooks

ROOT = Path(__file__).resolve().parent.parent
FILES = ("README.md", "CHANGELOG.md", "CONTRIBUTING.md", "SECURITY.md", "NOTICE")
FOLDERS = ("LICENSES", "docs")
LINK = re.compile(site_hooks.LINK_TEXT + r"\(([^)\s]+)\)")


def is_installed(page, target):
    if re.match(r"[a-z]+:|#", target):
        return True
    path = os.path.normpath(os.path.join(os.path.dirname(page), target.split("#")[0]))
    return path in FILES or path.split(os.sep)[0] in FOLDERS


def write(page, folder):
    text = (ROOT / page).read_text(encoding="utf-8")
    shown = LINK.sub(lambda link: link.group(0) if is_installed(page, link.group(2)) else link.group(1), text)
    (folder / page).write_text(shown, encoding="utf-8")


def main():
    folder = Path(sys.argv[1])
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    for name in FILES:
        shutil.copyfile(ROOT / name, folder / name)
    for name in FOLDERS:
        shutil.copytree(ROOT / name, folder / name)
    for path in [*folder.glob("*.md"), *folder.glob("docs/*.md")]:
        write(str(path.relative_to(folder)), folder)


if __name__ == "__main__":
    main()
