#!/usr/bin/env bash
# Builds ShapeDB into build/ (programs under build/bin/). Installs nothing: see install-deps.sh.
#   scripts/build.sh                    Release, programs only
#   scripts/build.sh --tests            with the tests
#   BUILD_DIR=... BUILD_TYPE=... SANITIZE=address,undefined scripts/build.sh
set -euo pipefail
cd "$(dirname "$0")/.."

tests=OFF
[ "${1:-}" = "--tests" ] && tests=ON
build_dir=${BUILD_DIR:-build}

# Paths below this folder count as relative, so that clones share what ccache keeps.
export CCACHE_BASEDIR="$PWD"

cmake -S . -B "$build_dir" -G Ninja \
  -DCMAKE_BUILD_TYPE="${BUILD_TYPE:-Release}" \
  -DSHAPEDB_BUILD_TESTS="$tests" \
  -DSHAPEDB_SANITIZE="${SANITIZE:-}"
cmake --build "$build_dir"
