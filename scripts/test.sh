#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Installs what is missing, checks the sources, builds with warnings as errors and runs every test but those of
# bench/, which have a lane of their own (scripts/ci/bench.sh). Everything that reads bytes of strangers is fuzzed for a
# moment, under sanitizers. Options go to ctest, e.g. -R core.Score; with any, nothing is fuzzed.
# With SHAPEDB_DATA naming a folder of public scans (docs/data.md) the tests that use them run too.
set -euo pipefail
cd "$(dirname "$0")/.."

scripts/install-deps.sh
scripts/install-deps.sh --postgres
# Here a missing PostgreSQL is a failure, not a reason to skip.
export REQUIRE_POSTGRES=1
scripts/ci/lint.sh
scripts/build.sh dev
[ $# -gt 0 ] || scripts/ci/fuzz.sh 5
# One more than there are cores: some tests wait for a server most of the time.
ctest --test-dir "${BUILD_DIR:-build}" --output-on-failure --no-label-summary --timeout 600 -j $(($(nproc) + 1)) "$@"
