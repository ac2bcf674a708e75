#!/usr/bin/env bash
# Builds ShapeDB into build/ (programs under build/bin/). Installs nothing: see install-deps.sh.
#   scripts/build.sh                    Release, programs only
#   scripts/build.sh --tests            with the tests
#   scripts/build.sh --bench            with shapedb-bench
#   scripts/build.sh --peers            with shapedb-bench and what it measures beside ours (install-deps.sh --bench)
#   BUILD_DIR=... BUILD_TYPE=... SANITIZE=address,undefined scripts/build.sh
set -euo pipefail
cd "$(dirname "$0")/.."

tests=OFF
bench=OFF
peers=OFF
for option in "$@"; do
  case "$option" in
    --tests) tests=ON ;;
    --bench) bench=ON ;;
    --peers) bench=ON; peers=ON ;;
    *) echo "build: unknown option $option; there are --tests, --bench and --peers" >&2; exit 2 ;;
  esac
done
build_dir=${BUILD_DIR:-build}

# Paths below this folder count as relative, so that clones share what ccache keeps.
export CCACHE_BASEDIR="$PWD"

cmake -S . -B "$build_dir" -G Ninja \
  -DCMAKE_BUILD_TYPE="${BUILD_TYPE:-Release}" \
  -DSHAPEDB_BUILD_TESTS="$tests" \
  -DSHAPEDB_BUILD_BENCH="$bench" -DSHAPEDB_BENCH_PCL="$peers" -DSHAPEDB_BENCH_FAISS="$peers" \
  -DSHAPEDB_SANITIZE="${SANITIZE:-}"
cmake --build "$build_dir"
