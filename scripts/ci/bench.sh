#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# The lane of shapedb-bench: builds it, compares instruction counts with the baseline, runs its tests.
set -euo pipefail
cd "$(dirname "$0")/../.."
scripts/install-deps.sh
scripts/build.sh bench
scripts/ci/instructions.sh "$@"
ctest --test-dir "${BUILD_DIR:-build}" --output-on-failure --timeout 900 -j "$(nproc)" -L bench
