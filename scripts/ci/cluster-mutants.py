#!/usr/bin/env python3
# SPDX-License-Identifier: GPL-3.0-or-later
"""Breaks server/cluster on purpose, one place after the other, and says whether the simulation notices.

   scripts/ci/cluster-mutants.py [BUILD_DIR]     fails if one fault is not found
The sources are put back in the end. SHAPEDB_TEST_SCALE: how many times as many histories (1: 600).
"""
import os
import pathlib
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
CLUSTER = ROOT / "server" / "cluster"

# What is broken; where: file, what stands there, and what stands there instead.
FAULTS = [
    ("a holder does not look at epochs",
     [("holder.cpp", "if (keeper.epoch(shard, now) != epoch) return Answerable::kNo;",
       "if (!keeper.epoch(shard, now)) return Answerable::kNo;")]),
    ("a lease lasts longer for who has it than for the table",
     [("lease_keeper.cpp", "lease.slot, lease.epoch, sentAt + lease.left}",
       "lease.slot, lease.epoch, sentAt + 3 * lease.left}")]),
    ("a server goes on answering for a shard that it hands over",
     [("lease_keeper.cpp",
       "            givenUp_.insert({lease.shard, lease.slot, lease.epoch});\n            own_[shard].reset();\n",
       "            givenUp_.insert({lease.shard, lease.slot, lease.epoch});\n")]),
    ("a shard counts twice, when an answer comes after another server was asked",
     [("gather.cpp", "    open_.erase(found);\n", "")]),
    ("nobody looks whether an answer knows the change that is asked for",
     [("holder.cpp", "content.number >= ask.atLeast && ", ""),
      ("gather.cpp", "coverage.number >= ask.atLeast &&", "")]),
    ("answers of two generations count together",
     [("gather.cpp", "        accepted_.clear();\n        covered_ &= ~again;\n", "")]),
    ("changes while a shard is loaded are not applied to it",
     [("replica.cpp", "source_.changes(collectionId_, known_, complete_ | loading_, pageRows_)",
       "source_.changes(collectionId_, known_, complete_, pageRows_)")]),
    ("a deleted shape stays", [("replica.cpp", "        content_.remove(changes->changed);\n", "")]),
]


def run(build: str) -> bool:
    """Whether the tests pass."""
    subprocess.run(["cmake", "--build", build, "--target", "shapedb_server_test"], cwd=ROOT, check=True,
                   stdout=subprocess.DEVNULL)
    test = [f"{build}/tests/shapedb_server_test", "--gtest_filter=ClusterSimulation.*", "--gtest_brief=1"]
    return subprocess.run(test, cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                          timeout=900).returncode == 0


def main() -> int:
    build = sys.argv[1] if len(sys.argv) > 1 else os.environ.get("BUILD_DIR", "build")
    missed = 0
    for what, edits in FAULTS:
        texts = {CLUSTER / name: (CLUSTER / name).read_text() for name, _, _ in edits}
        try:
            for name, old, new in edits:
                text = (CLUSTER / name).read_text()
                if text.count(old) != 1:
                    print(f"cluster-mutants: {name} has changed: '{old}' is not there once", file=sys.stderr)
                    return 2
                (CLUSTER / name).write_text(text.replace(old, new))
            found = not run(build)
        finally:
            for path, text in texts.items():
                path.write_text(text)
        missed += not found
        print(f"{'found ' if found else 'MISSED'}  {what}", flush=True)
    if not run(build):
        print("cluster-mutants: the simulation fails without a fault, too", file=sys.stderr)
        return 1
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
