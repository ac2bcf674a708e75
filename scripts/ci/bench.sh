#!/usr/bin/env bash
# shapedb-bench: builds it, runs its tests, compares instruction counts with the baseline.
set -euo pipefail
cd "$(dirname "$0")/../.."
scripts/install-deps.sh
scripts/build.sh --tests --bench
scripts/ci/instructions.sh "$@"
ctest --test-dir "${BUILD_DIR:-build}" --output-on-failure --timeout 900 -j "$(nproc)" -L bench
