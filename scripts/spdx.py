#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Which licence each file is under, and whether it says so (REUSE, https://reuse.software).

  scripts/spdx.py --check          complains of files that do not name their licence or name another one, of files
                                   under Apache-2.0 that include what is not, and of what the packages' copyright file
                                   says otherwise
  scripts/spdx.py --fix            writes the missing SPDX-License-Identifier lines
  scripts/spdx.py --linked FILE    complains of sources in FILE, one path a line, that are not under Apache-2.0
  scripts/spdx.py --licence PATH   prints the licence of a file

Files that cannot hold a comment, and SQL, whose text is hashed when it is applied, are in REUSE.toml.
"""

import argparse
import fnmatch
import pathlib
import re
import subprocess
import sys
import tomllib

ROOT = pathlib.Path(__file__).resolve().parent.parent
TAG = "SPDX-License-Identifier:"
GPL = "GPL-3.0-or-later"
APACHE = "Apache-2.0"

# CGAL's hull and Delaunay triangulation are under the GPL, and so is what is built on them. What follows is what others
# build into programs of their own, with all it is made of; nothing in it may include anything else of ours, nor CGAL.
APACHE_PATHS = [
    "proto/*", "client/api/*", "client/backup/*", "client/io/*", "client/examples/*", "client/python/*", "web/*", "common/*",
    "core/base/*", "core/profile.h", "core/fit/verdict_kinds.h", "core/segmentation/interior_kinds.h",
    "core/geometry/box.h", "core/geometry/main_part.*", "core/geometry/mesh.*", "core/geometry/motion.*", "core/geometry/point.h",
    "core/geometry/resolution.*", "tests/client/installed/*", "tests/integration/protocols/*", "tests/python/*", "tests/web/*",
]
# Of these folders, what knows core/ as a whole.
GPL_PATHS = ["common/wire.h", "common/wire.cpp"]

# Libraries that may be in nothing under Apache-2.0.
COPYLEFT_INCLUDES = ("CGAL/", "gmp", "mpfr")

# What the Debian packages say of each file (https://www.debian.org/doc/packaging-manuals/copyright-format/1.0/).
COPYRIGHT = "packaging/debian/copyright"

STYLES = {"// {}": ["*.cpp", "*.h", "*.inc", "*.proto", "*.ts", "*.mjs"],
          "# {}": ["*.py", "*.sh", "*.pl", "*.cmake", "*.toml", "*.yaml", "*.yml", "*.service.in", "*.supp", "CMakeLists.txt",
                   "*.cmake.in", "_version.py.in", "Dockerfile", ".ci/run", ".clang-format",
                   ".clang-tidy", ".dockerignore", ".gitattributes", ".gitignore", "pytest.ini", "postinst", "prerm",
                   "postrm", "*.sysusers"],
          "/* {} */": ["*.css"],
          "<!-- {} -->": ["*.html"]}
FIRST_LINES = ("#!", "<!doctype", "<!DOCTYPE")  # these stay first


def tracked_files() -> list[str]:
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, check=True, capture_output=True, text=True).stdout
    return [path for path in listed.split("\0") if path and (ROOT / path).is_file()]


def matches(path: str, patterns: list[str]) -> bool:
    return any(fnmatch.fnmatchcase(path, pattern) for pattern in patterns)


def licence_of(path: str) -> str:
    return APACHE if matches(path, APACHE_PATHS) and not matches(path, GPL_PATHS) else GPL


def style_of(path: str) -> str | None:
    name = path.rsplit("/", 1)[-1]
    for style, patterns in STYLES.items():
        if matches(name, patterns) or path in patterns:
            return style
    return None


class Annotations:
    """Those of REUSE.toml; of several that match a path the last counts."""

    def __init__(self) -> None:
        self.rules = []
        for entry in tomllib.loads((ROOT / "REUSE.toml").read_text())["annotations"]:
            paths = entry["path"] if isinstance(entry["path"], list) else [entry["path"]]
            if entry.get("SPDX-License-Identifier"):
                self.rules.append(([self.pattern(path) for path in paths], entry["SPDX-License-Identifier"]))

    @staticmethod
    def pattern(glob: str) -> re.Pattern[str]:
        parts = re.split(r"(\*\*|\*)", glob)
        return re.compile("".join({"**": ".*", "*": "[^/]*"}.get(part, re.escape(part)) for part in parts))

    def licence(self, path: str) -> str | None:
        for patterns, licence in reversed(self.rules):
            if any(pattern.fullmatch(path) for pattern in patterns):
                return licence
        return None


def copyright_rules() -> list[tuple[list[str], str]]:
    """The patterns and licence of each paragraph of the copyright file; the last that matches a path counts."""
    found = []
    for paragraph in (ROOT / COPYRIGHT).read_text().split("\n\n"):
        fields = dict(re.findall(r"^(Files|License):((?:.*\n?)(?:^ .*\n?)*)", paragraph, re.MULTILINE))
        if "Files" in fields:
            found.append((fields["Files"].split(), fields["License"].split()[0]))
    return found


def copyright_problems(annotations: Annotations) -> list[str]:
    rules = copyright_rules()
    found = []
    for path in tracked_files():
        said = next((licence for patterns, licence in reversed(rules) if matches(path, patterns)), None)
        expected = annotations.licence(path) or licence_of(path)
        if said != expected and not path.startswith("LICENSES/"):
            found.append(f"{COPYRIGHT} says that {path} is under {said}, and it is under {expected}")
    return found


def stated(text: str) -> str | None:
    for line in text.splitlines()[:3]:
        if TAG in line:
            return line.split(TAG, 1)[1].split()[0]
    return None


def read(path: str) -> str:
    with open(ROOT / path, encoding="utf-8", newline="") as file:  # line ends as they are
        return file.read()


def problems(annotations: Annotations) -> list[str]:
    found = []
    for path in tracked_files():
        if path.startswith("LICENSES/"):
            continue
        expected = annotations.licence(path)
        if style_of(path) is None or expected is not None:
            if expected is None:
                found.append(f"{path} has no licence: REUSE.toml does not name it")
            elif not (ROOT / "LICENSES" / f"{expected}.txt").is_file():
                found.append(f"the text of {expected} is not in LICENSES/ ({path})")
            continue
        text = read(path)
        found_licence = stated(text)
        if found_licence is None:
            found.append(f"{path} does not say its licence (scripts/spdx.py --fix)")
        elif found_licence != licence_of(path):
            found.append(f"{path} says {found_licence}, and scripts/spdx.py {licence_of(path)}")
        if licence_of(path) == APACHE and path.endswith((".cpp", ".h")):
            found += foreign_includes(path, text)
    return found


def foreign_includes(path: str, text: str) -> list[str]:
    found = []
    for kind, name in re.findall(r'^\s*#\s*include\s*([<"])([^>"]+)', text, re.MULTILINE):
        # What protoc makes of proto/ is no file of the tree.
        ours = kind == '"' and not name.startswith("shapedb/v1/")
        if name.startswith(COPYLEFT_INCLUDES) or (ours and licence_of(name) != APACHE):
            found.append(f"{path} is under {APACHE} and includes {name}, which is not")
    return found


def fix(annotations: Annotations) -> None:
    for path in tracked_files():
        style = style_of(path)
        if path.startswith("LICENSES/") or style is None or annotations.licence(path) is not None:
            continue
        text = read(path)
        if stated(text) is not None:
            continue
        line = style.format(f"{TAG} {licence_of(path)}") + "\n"
        at = text.find("\n") + 1 if text.startswith(FIRST_LINES) else 0
        with open(ROOT / path, "w", encoding="utf-8", newline="") as file:
            file.write(text[:at] + line + text[at:])


def linked_problems(listing: str) -> list[str]:
    sources = pathlib.Path(listing).read_text().split()
    if not sources:
        return [f"{listing} lists nothing"]
    return [f"{source} is linked into what is under {APACHE}, and is under {licence_of(source)}"
            for source in sources if licence_of(source) != APACHE]


def main() -> int:
    parser = argparse.ArgumentParser(description="Licences of the files, see the text at the top of this script.")
    what = parser.add_mutually_exclusive_group(required=True)
    what.add_argument("--check", action="store_true")
    what.add_argument("--fix", action="store_true")
    what.add_argument("--linked", metavar="FILE")
    what.add_argument("--licence", metavar="PATH")
    arguments = parser.parse_args()
    if arguments.licence:
        print(Annotations().licence(arguments.licence) or licence_of(arguments.licence))
        return 0
    if arguments.fix:
        fix(Annotations())
        return 0
    annotations = Annotations()
    found = linked_problems(arguments.linked) if arguments.linked else problems(annotations) + copyright_problems(annotations)
    for problem in found:
        print(f"spdx: {problem}", file=sys.stderr)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
