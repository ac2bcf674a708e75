# SPDX-License-Identifier: GPL-3.0-or-later
"""What the pages of the documentation tell a reader to type, block by block.

A block is fenced by ``` or indented by four blanks. By its first line and what stands behind ``` it is

  console   `$ COMMAND` lines, each with the output below it (a line `...` stands for any lines)
  sh        a script for bash
  python    the blocks of a page share their names
  js        a program for Node
  go        not run by anything
  unmarked  looks as if it were to be typed: it must be one of the above, or say why it is not run
  data      anything else: output, settings, formulas

Comments right above a block:

  <!-- setup: COMMAND -->    run first; the page does not show it
  <!-- not run: REASON -->   its commands are not run by any test of the documentation, and why
  <!-- output -->            what the block before this one prints

and anywhere in a page: <!-- data: SHAPEDB_DATA --> (the commands need the public scans of docs/data.md).
"""

import os
import re

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))

# The first word of what people type into a shell.
TYPED = re.compile(
    r"\s*(\$ |\(umask |([A-Z_]+=\S* )*(sudo )?"
    r"(shapedbd?|shapedb-bench|curl|printf|openssl|export|scripts/\S+|build/\S+|cmake|ctest|docker|podman|apt|apt-get|dpkg|"
    r"pip|python3|node|npm|systemctl|journalctl|git|go|valgrind|SHAPEDB_\w+=\S+)(\s|$))")


class Block:
    def __init__(self, page, line, kind, lines):
        self.page = page
        self.line = line  # of its first line of content, from 0
        self.kind = kind
        self.lines = lines
        self.setup = []
        self.not_run = None  # the reason
        self.is_output = False

    @property
    def where(self):
        return f"{self.page}:{self.line + 1}"


class Shown:
    """A command of a console and the lines of the page that are its output."""

    def __init__(self, line, command):
        self.line = line  # of the output, from 0
        self.command = command
        self.expected = []


def pages():
    """README.md and the pages of docs/, by their path in the project."""
    found = [os.path.join("docs", name) for name in sorted(os.listdir(os.path.join(ROOT, "docs"))) if name.endswith(".md")]
    return ["README.md"] + found


def read(page):
    with open(os.path.join(ROOT, page), encoding="utf-8") as file:
        return file.read()


def kind_of(info, lines, fenced):
    if info in ("sh", "bash"):
        return "sh"
    if info in ("python", "js", "go"):
        return info
    if info not in ("", "console"):
        return "data"
    if any(line.startswith("$ ") for line in lines):
        return "console"
    typed = any(TYPED.match(line) for line in lines) if fenced else TYPED.match(lines[0])
    return "unmarked" if typed else "data"


def blocks_of(page, text=None):
    """All blocks of a page, in order."""
    lines = (read(page) if text is None else text).split("\n")
    found = []
    comments = []
    number = 0
    after_blank = True  # an indented block follows a blank line and belongs to no list
    in_list = False
    while number < len(lines):
        line = lines[number]
        fence = re.fullmatch(r"( *)```(\w*)", line)
        if fence:
            end = number + 1
            while end < len(lines) and lines[end].strip() != "```":
                end += 1
            add(found, page, number + 1, fence.group(2), lines[number + 1:end], True, comments)
            number = end + 1
            after_blank = False
            continue
        indented = re.match(r"    +\S", line)
        if indented and after_blank and (not in_list or line.startswith("       ")):
            end = number
            while end < len(lines) and (lines[end].startswith("    ") or not lines[end].strip()):
                end += 1
            while not lines[end - 1].strip():
                end -= 1
            depth = min(len(each) - len(each.lstrip()) for each in lines[number:end] if each.strip())
            add(found, page, number, "", [each[depth:] for each in lines[number:end]], False, comments)
            number = end
            continue
        comment = re.fullmatch(r"\s*<!-- (setup|not run|output)(?:: (.*))? -->", line)
        if comment:
            comments.append((comment.group(1), comment.group(2)))
        elif line.strip():
            comments.clear()
            if re.match(r"\s*([-*]|\d+\.) ", line):
                in_list = True
            elif not line.startswith(" "):
                in_list = False
        after_blank = not line.strip() or bool(comment)
        number += 1
    return found


def add(found, page, line, info, lines, fenced, comments):
    block = Block(page, line, kind_of(info, lines, fenced), lines)
    for name, value in comments:
        if name == "setup":
            block.setup.append(value)
        elif name == "not run":
            block.not_run = value
        else:
            block.is_output = True
    comments.clear()
    found.append(block)


def commands_of(block):
    """The commands of a console with their outputs."""
    found = []
    goes_on = False
    for number, line in enumerate(block.lines):
        if goes_on:
            found[-1].command += "\n" + line
            found[-1].line += 1
        elif line.startswith("$ "):
            found.append(Shown(block.line + number + 1, line[2:]))
        elif found:
            found[-1].expected.append(line)
        goes_on = bool(found) and not found[-1].expected and line.endswith(("\\", "|"))
    return found


def needs_data(page):
    return "<!-- data: SHAPEDB_DATA -->" in read(page)


def not_run():
    """(where, reason, first line) of every block of commands that nobody runs."""
    return [(block.where, block.not_run, block.lines[0]) for page in pages() for block in blocks_of(page)
            if block.not_run is not None and block.kind != "data"]
