#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Keeps docs/constants.md complete: one row for every named constant of core/.

  scripts/constants.py            fails when a constant is missing from the page, listed but gone,
                                  listed with another value, or not classified
  scripts/constants.py --update   rewrites the tables; kind and reason of known rows stay
  scripts/constants.py --list     prints what is found in the sources

A constant is a `const` or `constexpr` object named kSomething at any scope, any `constexpr` object with a
number as its value, a macro or an enumerator of an enum without a name with a number, a member of a struct
named *Options, *Parameters or *Merging with a numeric default, or a number that core/pipeline.cpp gives such
a member in the profile `default`. Other enumerators are none.

A number with a decimal point or an exponent that is in none of these is an error, too, unless it is one that
needs no name (PLAIN) or in a file that is a table of numbers (TABLES). Whole numbers are not looked at.

A constant that moves, changes its value or is renamed within its file keeps its kind and reason with
--update. A new one gets the kind "?", which fails the check until someone writes both by hand.
"""
import hashlib
import os
import re
import sys

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
PAGE = os.path.join(ROOT, "docs", "constants.md")
KINDS = ("mathematical", "numerical", "measured", "chosen", "format", "engineering")
LONGEST_VALUE = 72

DECLARED = re.compile(
    r"\b(?:constexpr|const)\b[^;{}()=]*?[\s&*>](k[A-Z]\w*)\s*((?:\[[^\]]*\]\s*)*)(?=[={])")
PLAIN_DECLARED = re.compile(
    r"\bconstexpr\s+(?:(?:static|inline)\s+)*[\w:]+\s+([A-Za-z]\w*)\s*(?=(?:=\s*|\{\s*|\(\s*)[-+]?\.?\d)")
MACRO = re.compile(r"^[ \t]*#[ \t]*define[ \t]+(\w+)[ \t]+(?=[-+(]*\.?\d)", re.M)
NAMELESS_ENUM = re.compile(r"\benum\s*(?::\s*[\w:]+\s*)?\{([^}]*)\}")
ENUMERATOR = re.compile(r"(\w+)\s*=\s*([^,}]+)")
# Whether something is there to be compiled.
SWITCHES = ("SHAPEDB_HAS_AVX2", "SHAPEDB_DOUBLE2_SSE2", "SHAPEDB_HUGE_PAGES")
LITERAL = re.compile(r"(?<![\w.])(\d+\.\d*(?:e[-+]?\d+)?|\d+e[-+]?\d+)f?\b")
# Halves, quarters and small whole numbers; the largest values of 8 and 16 bits; degrees.
PLAIN = (0, 0.25, 0.5, 1, 1.5, 2, 3, 4, 5, 6, 7, 8, 10, 20, 100, 90, 180, 127, 255, 32767, 1024)
# Recipes of solids; ranges of histograms (docs/signature.md); units of length.
TABLES = ("core/synthetic/", "core/signature/statistics.cpp", "core/base/length_unit.h")
STRUCT = re.compile(r"\bstruct\s+(\w*(?:Options|Parameters|Merging))\s*\{")
MEMBER = re.compile(
    r"^\s*(?:std::)?(?:u?int\d+_t|size_t|double|float|int|unsigned|long)\s+(\w+)\s*=\s*([^;]+);", re.M)

PROFILE = "core/pipeline.cpp"
GIVEN = re.compile(r"^\s*(?:\w+\.)+(\w+) = ([\d.]+);", re.M)


def without_comments(text):
    """The text with comments blanked, lines kept, string literals left alone."""
    token = re.compile(r"//[^\n]*|/\*.*?\*/|\"(?:\\.|[^\"\\\n])*\"|'(?:\\.|[^'\\\n])+'", re.S)

    def blank(match):
        found = match.group(0)
        return re.sub(r"[^\n]", " ", found) if found.startswith("/") else found

    return token.sub(blank, text)


def end_of_initialiser(text, start):
    """Position of the semicolon that ends it."""
    depth = 0
    for at in range(start, len(text)):
        character = text[at]
        if character in "({[":
            depth += 1
        elif character in ")}]":
            depth -= 1
        elif character == ";" and depth == 0:
            return at
    return len(text)


def value_of(source):
    """One line for the table; long ones shortened, with a digest that changes when they do."""
    value = " ".join(source.split()).strip()
    if value.startswith("="):
        value = value[1:].strip()
    if len(value) > LONGEST_VALUE:
        digest = hashlib.sha256(value.encode()).hexdigest()[:8]
        value = value[:LONGEST_VALUE - 16].rstrip() + " ... #" + digest
    return value.replace("|", "\\|")


def code_of(path):
    with open(os.path.join(ROOT, path), encoding="utf-8") as file:
        return without_comments(file.read())


def declarations(text):
    """(start, end, name, value) of each object, macro and enumerator that is a constant, in order."""
    found = {}
    for pattern in (DECLARED, PLAIN_DECLARED):
        for match in pattern.finditer(text):
            end = end_of_initialiser(text, match.end())
            value = text[match.end():end]
            found[match.start(1)] = (match.start(), end, match.group(1), value_of(value))
    for match in MACRO.finditer(text):
        end = text.find("\n", match.end())
        if match.group(1) not in SWITCHES:
            found[match.start(1)] = (match.start(), end, match.group(1), value_of(text[match.end():end]))
    for enum in NAMELESS_ENUM.finditer(text):
        for match in ENUMERATOR.finditer(text, enum.start(1), enum.end(1)):
            found[match.start(1)] = (match.start(), match.end(), match.group(1), value_of(match.group(2)))
    return [found[at] for at in sorted(found)]


def bare_literals(path):
    """(line, literal) of numbers that are in no constant."""
    if path.startswith(TABLES):
        return
    text = code_of(path)
    text = re.sub(r'"(?:\\.|[^"\\\n])*"', lambda match: " " * len(match.group(0)), text)
    spans = [(start, end) for start, end, _, _ in declarations(text)]
    for struct in STRUCT.finditer(text):
        spans.append((struct.start(), end_of_initialiser(text, struct.end() - 1)))
    if path == PROFILE:
        spans += [match.span() for match in GIVEN.finditer(text)]
    for match in LITERAL.finditer(text):
        if float(match.group(1)) in PLAIN or any(start <= match.start() < end for start, end in spans):
            continue
        yield text.count("\n", 0, match.start()) + 1, match.group(0)


def constants_of(path):
    """(name, value) of each constant of a file, in order; a member's name is Struct::member."""
    text = code_of(path)
    found = [(start, name, value) for start, _, name, value in declarations(text)]
    for struct in STRUCT.finditer(text):
        body = text[struct.end():end_of_initialiser(text, struct.end() - 1)]
        for member in MEMBER.finditer(body):
            name = struct.group(1) + "::" + member.group(1)
            found.append((struct.end() + member.start(), name, value_of(member.group(2))))
    if path == PROFILE:
        for given in GIVEN.finditer(text):
            found.append((given.start(), "default::" + given.group(1), value_of(given.group(2))))
    found.sort()
    seen = {}
    result = []
    for _, name, value in found:
        seen[name] = seen.get(name, 0) + 1
        result.append((name if seen[name] == 1 else "%s (%d)" % (name, seen[name]), value))
    return result


def files_of_core():
    files = []
    for folder, _, names in os.walk(os.path.join(ROOT, "core")):
        for name in names:
            if name.endswith((".h", ".cpp")):
                files.append(os.path.relpath(os.path.join(folder, name), ROOT))
    return sorted(files)


def constants_of_core():
    """{file: [(name, value)]}, files by name."""
    found = {path: constants_of(path) for path in files_of_core()}
    return {path: rows for path, rows in found.items() if rows}


def rows_of_page():
    """The page's introduction, and its rows {(file, name): (value, kind, reason)}."""
    if not os.path.exists(PAGE):
        return "# Constants\n", {}
    with open(PAGE, encoding="utf-8") as file:
        text = file.read()
    rows = {}
    folder = None
    for line in text.split("\n"):
        if line.startswith("## core"):
            folder = line[3:].strip()
        if folder is None or not line.startswith("| `"):
            continue
        cells = [cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]]
        if len(cells) != 5:
            sys.exit("constants: five columns expected in: " + line)
        key = (folder + "/" + cells[0].strip("`"), cells[1].strip("`"))
        if key in rows:
            sys.exit("constants: %s of %s is listed twice" % (key[1], key[0]))
        rows[key] = (cells[2].strip("`"), cells[3], cells[4])
    return text.split("\n## core")[0].rstrip() + "\n", rows


def human_columns(rows, path, name, value, sources):
    """Kind and reason of a constant: its own row's; else those of lost rows of its name, or of its file
    and value, where these agree."""
    if (path, name) in rows:
        return rows[path, name][1:]
    lost = [key for key in rows if key[1] not in dict(sources.get(key[0], []))]
    moved = [key for key in lost if key[1] == name]
    moved_with_file = [key for key in moved if os.path.basename(key[0]) == os.path.basename(path)]
    renamed = [key for key in lost if key[0] == path and rows[key][0] == value]
    for candidates in (moved_with_file, moved, renamed):
        texts = {rows[key][1:] for key in candidates}
        if len(texts) == 1:
            return texts.pop()
    return "?", ""


def update():
    sources = constants_of_core()
    introduction, rows = rows_of_page()
    lines = [introduction.rstrip()]
    folder = None
    for path, constants in sorted(sources.items(), key=lambda item: os.path.split(item[0])):
        if os.path.dirname(path) != folder:
            folder = os.path.dirname(path)
            lines += ["", "## " + folder, "", "| file | name | value | kind | reason |", "|---|---|---|---|---|"]
        for name, value in constants:
            kind, reason = human_columns(rows, path, name, value, sources)
            lines.append("| `%s` | `%s` | `%s` | %s | %s |"
                         % (os.path.basename(path), name, value, kind, reason))
    with open(PAGE, "w", encoding="utf-8") as file:
        file.write("\n".join(lines) + "\n")


def complaints():
    sources = constants_of_core()
    _, rows = rows_of_page()
    found = {(path, name): value for path, constants in sources.items() for name, value in constants}
    for (path, name), value in found.items():
        if (path, name) not in rows:
            yield "%s: %s is not listed" % (path, name)
            continue
        listed, kind, reason = rows[path, name]
        if listed != value:
            yield "%s: %s is %s, listed as %s" % (path, name, value, listed)
        if kind not in KINDS:
            yield "%s: %s has the kind '%s', none of %s" % (path, name, kind, ", ".join(KINDS))
        elif not reason:
            yield "%s: %s has no reason" % (path, name)
    for path, name in rows:
        if (path, name) not in found:
            yield "%s: %s is listed, but gone" % (path, name)
    for path in files_of_core():
        for line, literal in bare_literals(path):
            yield "%s:%d: %s has no name: make it a constant" % (path, line, literal)


def main(arguments):
    if arguments == ["--list"]:
        for path, constants in constants_of_core().items():
            for name, value in constants:
                print("%s\t%s\t%s" % (path, name, value))
        return 0
    if arguments == ["--update"]:
        update()
    elif arguments:
        sys.exit(__doc__)
    problems = list(complaints())
    for problem in problems:
        print("constants: " + problem, file=sys.stderr)
    if problems:
        print("constants: after scripts/constants.py --update, write kind and reason in docs/constants.md",
              file=sys.stderr)
        return 1
    print("constants: %d listed" % len(rows_of_page()[1]))
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
