#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Counts the instructions of small fixed jobs under callgrind and compares them with the committed baseline,
# bench/instructions.json; fails if a job grew by more than 3 %. Counts depend on the compiler, the C library,
# valgrind and the processor's instruction sets: in another environment than the baseline's the lane shows them,
# says that nothing was compared, and passes.
#   scripts/ci/instructions.sh             compare
#   scripts/ci/instructions.sh --update    write a new baseline
#   BUILD_DIR=... scripts/ci/instructions.sh [--margin SHARE]
set -euo pipefail
cd "$(dirname "$0")/../.."

build_dir=${BUILD_DIR:-build}
scripts/install-deps.sh
export CCACHE_BASEDIR="$PWD"
cmake --preset bench -B "$build_dir"
cmake --build "$build_dir" --target shapedb_bench
exec "$build_dir/bin/shapedb-bench" instructions bench/instructions.json "$@"
