#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""Installs ShapeDB into folders of its own and uses what is there as a stranger would: builds a program outside the tree
against the client library, starts the installed server, and talks to it by the program, the command and the Python package.

Environment: BUILD (ShapeDB's build folder), WORK (emptied first), GENERATOR, COMPILER.
"""

import os
import pathlib
import re
import shutil
import signal
import subprocess
import sys
import unittest

BUILD = pathlib.Path(os.environ["BUILD"])
WORK = pathlib.Path(os.environ["WORK"])
HERE = pathlib.Path(__file__).resolve().parent
ROOT = HERE.parent.parent.parent
PREFIX = WORK / "prefix"
COMPONENTS = {
    "server": ["bin/shapedbd", "etc/shapedb/shapedbd.toml", "lib/systemd/system/shapedbd.service", "lib/sysusers.d/shapedb.conf",
               "share/man/man8/shapedbd.8.gz"],
    "client": ["bin/shapedb"],
    "development": ["include/shapedb/client/api/client.h", "share/shapedb/proto/shapedb/v1/types.proto"],
    "python": ["lib/python3/dist-packages/shapedb/__init__.py", "lib/python3/dist-packages/shapedb/v1/types_pb2.py"],
    "docs": ["share/doc/shapedb/docs/install.md", "share/doc/shapedb/README.md", "share/doc/shapedb/LICENSES/Apache-2.0.txt"],
}


def run(*command, **options):
    """What it prints; fails with what it complained of."""
    done = subprocess.run([str(part) for part in command], text=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE, timeout=240,
                          **options)
    if done.returncode != 0:
        raise AssertionError(f"{command} failed: {done.stdout}{done.stderr}")
    return done.stdout


def install(prefix, *options):
    run("cmake", "--install", BUILD, "--prefix", prefix, *options)


def files_below(folder):
    return {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()}


class Installed(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        shutil.rmtree(WORK, ignore_errors=True)
        install(PREFIX)
        run("cmake", "-S", HERE, "-B", WORK / "program", "-G", os.environ["GENERATOR"], "-D", f"CMAKE_PREFIX_PATH={PREFIX}",
            "-D", f"CMAKE_CXX_COMPILER={os.environ['COMPILER']}", "-D", f"QUICK={ROOT}/client/examples/quick.cpp")
        run("cmake", "--build", WORK / "program")
        cls.server = subprocess.Popen([PREFIX / "bin/shapedbd", "--config", PREFIX / "etc/shapedb/shapedbd.toml", "--listen",
                                       "127.0.0.1:0", "--data", WORK / "data"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL,
                                      text=True)
        cls.address = cls.server.stdout.readline().removeprefix("listening on ").strip()

    @classmethod
    def tearDownClass(cls):
        cls.server.send_signal(signal.SIGTERM)
        cls.server.communicate(timeout=60)

    def test_components_are_the_whole_and_share_no_file(self):
        found = {}
        for component, expected in COMPONENTS.items():
            install(WORK / component, "--component", component)
            files = files_below(WORK / component)
            self.assertLessEqual(set(expected), files, component)
            for file in files:
                self.assertNotIn(file, found, f"in {component} too")
                found[file] = component
        self.assertEqual(set(found), files_below(PREFIX))

    def test_links_between_installed_pages_lead_to_files(self):
        folder = PREFIX / "share/doc/shapedb"
        pages = [*folder.glob("*.md"), *folder.glob("docs/*.md")]
        self.assertGreater(len(pages), 40)
        kept = 0
        for page in pages:
            for target in re.findall(r"\]\(([^)#\s]+)(?:#[^)\s]*)?\)", re.sub(r"```.*?```", "", page.read_text(), flags=re.DOTALL)):
                if not re.match(r"[a-z]+:", target):
                    self.assertTrue((page.parent / target).exists(), f"{page}: {target}")
                    kept += 1
        self.assertGreater(kept, 300)

    def test_a_program_outside_the_tree_links_the_library(self):
        self.assertEqual(run(WORK / "program/program"), "unavailable\n")
        printed = run(WORK / "program/quick", self.address)
        self.assertRegex(printed, r"^dumbbell: (created|unchanged), version 1\n1\.000  dumbbell\n$")

    def test_the_library_has_nothing_under_the_gpl(self):
        libraries = run("ldd", WORK / "program/quick")
        self.assertIn("libgrpc++", libraries)
        self.assertNotRegex(libraries, "libgmp|libmpfr")
        archive = next(PREFIX.glob("lib*/**/libshapedb_client.a"))
        self.assertNotIn("CGAL", run("nm", "-C", archive))
        self.assertIn("CGAL", run("nm", "-C", BUILD / "core/geometry/libshapedb_geometry.a"))
        run(sys.executable, ROOT / "scripts/spdx.py", "--linked", BUILD / "client/linked_sources.txt")

    def test_what_is_linked_is_refused_when_it_is_under_the_gpl(self):
        listing = WORK / "linked.txt"
        listing.write_text("client/api/client.cpp\ncore/geometry/convex_hull.cpp\n")
        with self.assertRaisesRegex(AssertionError, "convex_hull.cpp is linked into what is under Apache-2.0"):
            run(sys.executable, ROOT / "scripts/spdx.py", "--linked", listing)

    def test_the_python_package_talks_to_the_server(self):
        environment = {**os.environ, "PYTHONPATH": str(PREFIX / "lib/python3/dist-packages"), "PYTHONDONTWRITEBYTECODE": "1"}
        program = f"import shapedb\nwith shapedb.Client({self.address!r}) as client: print(shapedb.__file__, client.collection().count())"
        file, count = run("/usr/bin/python3", "-c", program, env=environment, cwd=WORK).split()
        self.assertTrue(file.startswith(str(PREFIX)), file)
        self.assertIn(count, ("0", "1"))

    def test_the_command_talks_to_the_server(self):
        self.assertIn("serving", run(PREFIX / "bin/shapedb", "--server", self.address, "health").lower())

    def test_programs_tell_version_and_build(self):
        for name in ("shapedb", "shapedbd"):
            first, second = run(PREFIX / "bin" / name, "--version").splitlines()
            self.assertRegex(first, rf"^{name} \d+\.\d+\.\d+$")
            self.assertRegex(second, r"^commit ([0-9a-f]{12}(-modified)?|unknown), \w+, \w+ \d+(\.\d+)*$")

    def test_the_service_names_the_installed_program(self):
        unit = (PREFIX / "lib/systemd/system/shapedbd.service").read_text()
        self.assertIn(f"ExecStart={PREFIX}/bin/shapedbd --config {PREFIX}/etc/shapedb/shapedbd.toml\n", unit)
        shown = run(PREFIX / "bin/shapedbd", "--config", PREFIX / "etc/shapedb/shapedbd.toml", "--check-config")
        self.assertIn("data = '/var/lib/shapedb'", shown)
        if shutil.which("systemd-analyze"):
            run("systemd-analyze", "verify", "--man=no", PREFIX / "lib/systemd/system/shapedbd.service")

    def test_another_installation_keeps_the_configuration(self):
        prefix = WORK / "again"
        install(prefix, "--component", "server")
        config = prefix / "etc/shapedb/shapedbd.toml"
        config.write_text("listen = '127.0.0.1:1'\n")
        install(prefix, "--component", "server")
        self.assertEqual(config.read_text(), "listen = '127.0.0.1:1'\n")

    def test_manual_pages_have_no_mistakes(self):
        if not shutil.which("groff"):
            self.skipTest("groff is not installed")
        for page in PREFIX.glob("share/man/man*/*.gz"):
            text = run("zcat", page)
            warnings = subprocess.run(["groff", "-man", "-Tutf8", "-wall", "-Wbreak", "-z"], input=text, text=True, capture_output=True).stderr
            self.assertEqual(warnings, "", page.name)


class Stamp(unittest.TestCase):
    """cmake/stamp_build.cmake: the commit, and that the source is only touched by a change."""

    def setUp(self):
        self.source = WORK / "stamp" / self.id().rsplit(".", 1)[-1]
        shutil.rmtree(self.source, ignore_errors=True)
        (self.source / "cmake").mkdir(parents=True)
        (self.source / "cmake/source_commit.txt").write_text((ROOT / "cmake/source_commit.txt").read_text())
        self.output = self.source / "out.cpp"

    def stamp(self, *options):
        run("cmake", "-D", f"SOURCE={self.source}", "-D", f"OUTPUT={self.output}", "-D", "BUILD_TYPE=Release", "-D",
            "COMPILER=GNU 12", *options, "-P", ROOT / "cmake/stamp_build.cmake")
        return re.search('"commit (.*), Release, GNU 12"', self.output.read_text())[1]

    def test_without_git_it_is_unknown(self):
        # The folder may lie in a checkout, of which it is no part.
        self.assertEqual(self.stamp(), "unknown")

    def test_given_or_archived(self):
        self.assertEqual(self.stamp("-D", "COMMIT=0123abc"), "0123abc")
        (self.source / "cmake/source_commit.txt").write_text("0123456789abcdef0123456789abcdef01234567\n")
        self.assertEqual(self.stamp(), "0123456789ab")

    def test_a_checkout_and_what_is_modified_in_it(self):
        git = lambda *words: run("git", "-C", self.source, "-c", "user.name=a", "-c", "user.email=a@b", *words)
        git("init", "-q")
        git("add", "cmake")
        git("commit", "-qm", "first")
        commit = git("rev-parse", "--short=12", "HEAD").strip()
        self.assertEqual(self.stamp(), commit)
        written = self.output.stat().st_mtime_ns
        self.assertEqual(self.stamp(), commit)
        self.assertEqual(self.output.stat().st_mtime_ns, written)
        (self.source / "cmake/source_commit.txt").write_text("other\n")
        self.assertEqual(self.stamp(), commit + "-modified")


if __name__ == "__main__":
    unittest.main()
