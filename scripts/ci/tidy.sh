#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# clang-tidy with the checks of .clang-tidy over the sources of the programs.
#   scripts/ci/tidy.sh                  every source
#   scripts/ci/tidy.sh --base REVISION  those that differ from a revision
#   scripts/ci/tidy.sh FILE...
set -euo pipefail
cd "$(dirname "$0")/../.."
if [ "${1:-}" = --base ]; then
  files=$(git diff --name-only --diff-filter=d "${2:?name a revision}" -- 'core/*.cpp' 'common/*.cpp' 'server/*.cpp' 'client/*.cpp' 'bench/*.cpp')
elif [ $# -gt 0 ]; then
  files=$(printf '%s\n' "$@")
else
  files=$(git ls-files -- 'core/*.cpp' 'common/*.cpp' 'server/*.cpp' 'client/*.cpp' 'bench/*.cpp')
fi
# Only with the peers installed can these be parsed.
files=$(grep -vE '^bench/(pcl_methods|faiss_vector_scan)\.cpp$' <<< "$files" || true)
[ -n "$files" ] || { echo "tidy: nothing to check"; exit 0; }
scripts/install-deps.sh --analysis

# A folder of its own, in which each source is compiled alone: clang cannot read g++'s precompiled headers.
build_dir=${BUILD_DIR:-build-tidy}
cmake --preset bench -B "$build_dir" -DCMAKE_CXX_COMPILER=clang++-14 -DCMAKE_C_COMPILER=clang-14 \
  -DCMAKE_DISABLE_PRECOMPILE_HEADERS=ON -DSHAPEDB_UNITY=OFF > /dev/null
# The headers that protoc generates, and nothing compiled.
ninja -C "$build_dir" $(ninja -C "$build_dir" -t targets all | sed -nE 's/^(.*\.pb\.h): .*/\1/p') > /dev/null
xargs -P "$(nproc)" -n 4 clang-tidy-14 -p "$build_dir" --quiet <<< "$files"
echo "tidy: clean"
