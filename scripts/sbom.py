#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Writes what is linked into a program as SPDX 2.3 (JSON): the Debian packages of its shared libraries, and of the
archives and headers compiled into it; for the server the npm packages in the web page too.

  scripts/sbom.py --build build --program build/bin/shapedbd --name shapedb-server --version 0.1.0 --output FILE
                  [--page build/web/page.packages.txt --page-lock web/package-lock.json]

Nothing is listed by hand: ldd names the shared libraries, ninja (whose build folder it must be) archives and headers,
dpkg the packages these came with.
"""

import argparse
import datetime
import hashlib
import json
import os
import pathlib
import re
import subprocess
import sys
import urllib.parse

OWN = "SPDXRef-Program"


def output_of(*command: str, cwd: str | None = None) -> str:
    return subprocess.run(command, cwd=cwd, check=True, capture_output=True, text=True).stdout


def shared_libraries(program: str) -> set[str]:
    """Paths, and the dynamic loader."""
    return {os.path.realpath(path) for path in re.findall(r"(?:=> |^\s*)(/\S+) \(0x", output_of("ldd", program), re.MULTILINE)}


def compiled_in(build: str, program: str) -> set[str]:
    """Archives and headers of the system that ninja used for the program."""
    target = os.path.relpath(program, build)
    inputs = output_of("ninja", "-t", "inputs", target, cwd=build).splitlines()
    objects = [path for path in inputs if path.endswith(".o")]
    headers = output_of("ninja", "-t", "deps", *objects, cwd=build).split()
    return {os.path.realpath(path) for path in headers + [path for path in inputs if path.endswith(".a")] if path.startswith("/usr/")}


def packages_of(paths: set[str]) -> set[str]:
    """Names as dpkg has them, with the architecture where it says one. A path may be that of before /usr was merged."""
    found, unknown = set(), []
    for spelled in (lambda path: path, lambda path: path.removeprefix("/usr")):
        asked = sorted(spelled(path) for path in (unknown or paths))
        run = subprocess.run(["dpkg-query", "-S", *asked], capture_output=True, text=True)
        owned = set()
        for line in run.stdout.splitlines():
            owners, _, path = line.rpartition(": ")
            if owners.startswith("diversion by"):
                continue
            owned.add(path)
            found.update(owner.strip() for owner in owners.split(","))
        unknown = [path for path in asked if path not in owned]
        if not unknown:
            return found
    # Whatever was not installed by dpkg must be named all the same.
    raise SystemExit(f"sbom: of no package: {' '.join(unknown[:5])}")


def debian_package(name: str) -> dict:
    fields = ["Package", "Version", "Architecture", "source:Package", "source:Version", "Homepage"]
    row = output_of("dpkg-query", "-W", "-f", "\t".join("${" + field + "}" for field in fields), name).split("\t")
    package, version, architecture, source, source_version, homepage = row
    quoted = urllib.parse.quote(version, safe="")
    return entry(package, version, f"pkg:deb/debian/{urllib.parse.quote(package)}@{quoted}?arch={architecture}",
                 "NOASSERTION", homepage, f"Built from {source} {source_version}. Licence: /usr/share/doc/{package}/copyright")


def npm_package(name: str, lock: dict) -> dict:
    locked = lock["packages"][f"node_modules/{name}"]
    purl = f"pkg:npm/{urllib.parse.quote(name, safe='/')}@{locked['version']}"
    return entry(name, locked["version"], purl, locked.get("license", "NOASSERTION").strip("()"), "", "In the web page")


def entry(name: str, version: str, purl: str, licence: str, homepage: str, comment: str) -> dict:
    package = {
        "SPDXID": "SPDXRef-" + re.sub(r"[^A-Za-z0-9.-]", "-", purl.split("?")[0].removeprefix("pkg:")),
        "name": name, "versionInfo": version, "downloadLocation": "NOASSERTION", "filesAnalyzed": False,
        "licenseConcluded": "NOASSERTION", "licenseDeclared": licence, "copyrightText": "NOASSERTION", "comment": comment,
        "externalRefs": [{"referenceCategory": "PACKAGE-MANAGER", "referenceType": "purl", "referenceLocator": purl}],
    }
    if homepage:
        package["homepage"] = homepage
    return package


def time_of_creation() -> str:
    epoch = os.environ.get("SOURCE_DATE_EPOCH")
    now = datetime.datetime.now(datetime.timezone.utc)
    time = datetime.datetime.fromtimestamp(int(epoch), datetime.timezone.utc) if epoch else now
    return time.strftime("%Y-%m-%dT%H:%M:%SZ")


def main() -> int:
    parser = argparse.ArgumentParser()
    for required in ("--build", "--program", "--name", "--version", "--output"):
        parser.add_argument(required, required=True)
    parser.add_argument("--page")
    parser.add_argument("--page-lock")
    arguments = parser.parse_args()

    own = entry(arguments.name, arguments.version, f"pkg:generic/{arguments.name}@{arguments.version}", "GPL-3.0-or-later", "",
                output_of(arguments.program, "--version").strip().replace("\n", ", "))
    own["SPDXID"] = OWN
    linked = [(debian_package(name), "DYNAMIC_LINK") for name in sorted(packages_of(shared_libraries(arguments.program)))]
    linked += [(debian_package(name), "STATIC_LINK") for name in sorted(packages_of(compiled_in(arguments.build, arguments.program)))]
    if arguments.page:
        lock = json.loads(pathlib.Path(arguments.page_lock).read_text())
        linked += [(npm_package(name, lock), "CONTAINS") for name in pathlib.Path(arguments.page).read_text().split()]

    packages = {package["SPDXID"]: package for package, _ in linked}
    content = json.dumps([own, packages], sort_keys=True)
    document = {
        "spdxVersion": "SPDX-2.3", "dataLicense": "CC0-1.0", "SPDXID": "SPDXRef-DOCUMENT", "name": arguments.name,
        "documentNamespace": f"https://spdx.org/spdxdocs/{arguments.name}-{hashlib.sha256(content.encode()).hexdigest()[:32]}",
        "creationInfo": {"created": time_of_creation(), "creators": ["Tool: sbom.py"]},
        "comment": "DYNAMIC_LINK: shared libraries; STATIC_LINK: archives, and headers whose code is compiled in.",
        "packages": [own, *packages.values()],
        "relationships": [{"spdxElementId": "SPDXRef-DOCUMENT", "relationshipType": "DESCRIBES", "relatedSpdxElement": OWN}]
        + [{"spdxElementId": OWN, "relationshipType": kind, "relatedSpdxElement": package["SPDXID"]} for package, kind in linked],
    }
    pathlib.Path(arguments.output).write_text(json.dumps(document, indent=1, ensure_ascii=False) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
