#!/usr/bin/env bash
# Installs what is missing, builds Release with warnings as errors, runs every test but those of bench/, which
# have a lane of their own (scripts/ci/bench.sh).
# With SHAPEDB_DATA naming a folder of public scans (docs/data.md) the tests that use them run too.
set -euo pipefail
cd "$(dirname "$0")/.."

scripts/install-deps.sh
scripts/ci/lint.sh
scripts/build.sh --tests
ctest --test-dir "${BUILD_DIR:-build}" --output-on-failure --timeout 600 -j "$(nproc)" "$@"
