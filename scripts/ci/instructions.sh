#!/usr/bin/env bash
# Counts the instructions of small fixed jobs under callgrind and compares them with the committed
# baseline, bench/instructions.json: a job that grew by over 3 % fails. Counts depend on the compiler, the C
# library, valgrind and the processor's instruction sets; elsewhere than where the baseline was made
# the lane shows them, says that nothing was compared, and passes.
#   scripts/ci/instructions.sh             compare
#   scripts/ci/instructions.sh --update    write the baseline anew
#   BUILD_DIR=... scripts/ci/instructions.sh [--margin SHARE]
set -euo pipefail
cd "$(dirname "$0")/../.."

build_dir=${BUILD_DIR:-build}
scripts/install-deps.sh
export CCACHE_BASEDIR="$PWD"
cmake --preset bench -B "$build_dir"
cmake --build "$build_dir" --target shapedb_bench
exec "$build_dir/bin/shapedb-bench" instructions bench/instructions.json "$@"
