#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Does scripts/spdx.py notice what it is there for? In a repository made for each test."""

import pathlib
import shutil
import subprocess
import sys
import tempfile
import unittest

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
APACHE = "// SPDX-License-Identifier: Apache-2.0\n"
GPL = "// SPDX-License-Identifier: GPL-3.0-or-later\n"


class Licences(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(tempfile.mkdtemp())
        self.addCleanup(shutil.rmtree, self.folder)
        self.run_git("init", "-q")
        for name in ("scripts/spdx.py", "REUSE.toml", "LICENSES/Apache-2.0.txt", "LICENSES/GPL-3.0-or-later.txt",
                     "packaging/debian/copyright"):
            self.write(name, (ROOT / name).read_text())
        self.spdx("--fix")

    def run_git(self, *words):
        subprocess.run(["git", "-C", self.folder, *words], check=True)

    def write(self, name, text):
        path = self.folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
        self.run_git("add", name)

    def spdx(self, *options):
        return subprocess.run([sys.executable, self.folder / "scripts/spdx.py", *options], capture_output=True, text=True)

    def complaint(self):
        checked = self.spdx("--check")
        self.assertEqual(checked.returncode, 1 if checked.stderr else 0)
        return checked.stderr

    def test_nothing_to_say(self):
        self.write("client/api/a.cpp", APACHE + '#include "core/base/error.h"\n#include "shapedb/v1/types.pb.h"\n')
        self.write("core/pipeline.cpp", GPL + '#include <CGAL/Surface_mesh.h>\n')
        self.write("migrations/sqlite/0001_first.sql", "CREATE TABLE a (b);\n")
        self.assertEqual(self.complaint(), "")

    def test_a_file_that_does_not_say_its_licence_until_it_is_fixed(self):
        self.write("scripts/a.sh", "#!/bin/sh\necho\n")
        self.write("web/src/a.ts", "export const a = 1;\r\n")
        self.assertEqual(self.complaint().count("does not say its licence"), 2)
        self.spdx("--fix")
        self.assertEqual(self.complaint(), "")
        self.assertEqual((self.folder / "scripts/a.sh").read_text(), "#!/bin/sh\n# SPDX-License-Identifier: GPL-3.0-or-later\necho\n")
        self.assertEqual((self.folder / "web/src/a.ts").read_bytes(), (APACHE + "export const a = 1;\r\n").encode())

    def test_another_licence_than_the_folders(self):
        self.write("client/api/a.cpp", GPL)
        self.assertIn("client/api/a.cpp says GPL-3.0-or-later, and scripts/spdx.py Apache-2.0", self.complaint())

    def test_apache_includes_what_is_not(self):
        self.write("client/api/a.cpp", APACHE + '#include "core/geometry/convex_hull.h"\n')
        self.write("core/base/a.h", APACHE + "#  include <CGAL/Origin.h>\n")
        self.write("common/sums.cpp", APACHE + '#include "common/wire.h"\n')
        complaint = self.complaint()
        for included in ("core/geometry/convex_hull.h", "CGAL/Origin.h", "common/wire.h"):
            self.assertIn(f"is under Apache-2.0 and includes {included}, which is not", complaint)

    def test_the_packages_say_another_licence(self):
        self.write("common/wire.cpp", GPL)
        self.write("core/base/a.h", APACHE)
        name = "packaging/debian/copyright"
        self.assertEqual(self.complaint(), "")
        self.write(name, (self.folder / name).read_text().replace("Files: common/wire.h common/wire.cpp", "Files: none"))
        self.assertIn(f"{name} says that common/wire.cpp is under Apache-2.0, and it is under GPL-3.0-or-later", self.complaint())
        self.write(name, (ROOT / name).read_text().replace("core/base/* ", ""))
        self.assertIn(f"{name} says that core/base/a.h is under GPL-3.0-or-later, and it is under Apache-2.0", self.complaint())

    def test_a_file_without_comments_that_no_table_names(self):
        self.write("assets/a.bin", "x")
        self.assertIn("assets/a.bin has no licence: REUSE.toml does not name it", self.complaint())


if __name__ == "__main__":
    unittest.main()
