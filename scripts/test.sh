#!/usr/bin/env bash
# Installs what is missing, builds Release with warnings as errors, compares instruction counts with the
# baseline, runs every test.
# With SHAPEDB_DATA naming a folder of public scans (docs/data.md) the tests that use them run too.
set -euo pipefail
cd "$(dirname "$0")/.."

scripts/install-deps.sh
scripts/ci/lint.sh
scripts/build.sh --tests
scripts/ci/instructions.sh
ctest --test-dir "${BUILD_DIR:-build}" --output-on-failure --timeout 600 -j "$(nproc)" "$@"
