#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Do the lists of what is linked name what is linked, and nothing else? Environment: BUILD, WORK (folders), PAGE (the list
of npm packages in the web page; empty without one)."""

import json
import os
import pathlib
import re
import subprocess
import sys
import unittest

BUILD = pathlib.Path(os.environ["BUILD"])
WORK = pathlib.Path(os.environ["WORK"])
ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
PAGE = os.environ["PAGE"]


def write_list(program, name, *options):
    output = WORK / f"{name}.json"
    subprocess.run([sys.executable, ROOT / "scripts/sbom.py", "--build", BUILD, "--program", BUILD / "bin" / program, "--name", name,
                    "--version", "1.2.3", "--output", output, *options], check=True)
    return json.loads(output.read_text())


def linked(document, kind):
    names = {package["SPDXID"]: package["name"] for package in document["packages"]}
    return {names[row["relatedSpdxElement"]] for row in document["relationships"] if row["relationshipType"] == kind}


class Lists(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        page = ["--page", PAGE, "--page-lock", ROOT / "web/package-lock.json"] if PAGE else []
        cls.server = write_list("shapedbd", "shapedb-server", *page)
        cls.client = write_list("shapedb", "shapedb-client")

    def test_all_libraries_that_the_program_names_are_in_it(self):
        for program, document in (("shapedbd", self.server), ("shapedb", self.client)):
            needed = subprocess.run(["readelf", "-d", BUILD / "bin" / program], check=True, capture_output=True, text=True).stdout
            for library in re.findall(r"NEEDED.*\[(.+)\]", needed):
                owners = subprocess.run(["dpkg-query", "-S", f"*/{library}"], check=True, capture_output=True, text=True).stdout
                packages = {line.split(":")[0] for line in owners.splitlines()}
                self.assertTrue(packages & linked(document, "DYNAMIC_LINK"), f"{library} of {packages}")

    def test_headers_that_are_compiled_in(self):
        self.assertLessEqual({"libcgal-dev", "libeigen3-dev", "libboost1.74-dev", "libtomlplusplus-dev", "libexpected-dev"},
                             linked(self.server, "STATIC_LINK"))
        self.assertLessEqual({"libcgal-dev", "libcli11-dev", "nlohmann-json3-dev"}, linked(self.client, "STATIC_LINK"))

    def test_nothing_else_is_in_it(self):
        everything = linked(self.server, "STATIC_LINK") | linked(self.server, "DYNAMIC_LINK")
        self.assertFalse({"libgtest-dev", "libgmock-dev", "libpng16-16", "libzip4", "cmake"} & everything)
        everything = linked(self.client, "STATIC_LINK") | linked(self.client, "DYNAMIC_LINK")
        self.assertFalse({"libsqlite3-0", "libspdlog1.10", "prometheus-cpp-dev"} & everything)

    @unittest.skipUnless(PAGE, "built without the web page")
    def test_the_page_has_its_npm_packages(self):
        self.assertEqual(linked(self.server, "CONTAINS"), {"three", "@bufbuild/protobuf"})
        three = next(package for package in self.server["packages"] if package["name"] == "three")
        self.assertEqual(three["licenseDeclared"], "MIT")
        self.assertEqual(three["externalRefs"][0]["referenceLocator"], f"pkg:npm/three@{three['versionInfo']}")

    def test_the_notice_names_the_npm_packages(self):
        notice = (ROOT / "NOTICE").read_text()
        for name in json.loads((ROOT / "web/package.json").read_text())["dependencies"]:
            self.assertIn(name, notice)

    def test_documents_hold_together(self):
        for document in (self.server, self.client):
            ids = [package["SPDXID"] for package in document["packages"]]
            self.assertEqual(len(ids), len(set(ids)))
            for identifier in ids:
                self.assertRegex(identifier, r"^SPDXRef-[A-Za-z0-9.-]+$")
            for row in document["relationships"]:
                self.assertIn(row["relatedSpdxElement"], ids)
            self.assertRegex(document["creationInfo"]["created"], r"^\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ$")
            self.assertEqual(document["packages"][0]["versionInfo"], "1.2.3")


if __name__ == "__main__":
    unittest.main()
