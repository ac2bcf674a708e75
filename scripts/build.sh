#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Builds ShapeDB with a preset of CMakePresets.json; programs end up in build/bin/. Installs nothing: see
# install-deps.sh.
#   scripts/build.sh            the programs, in build/ (preset release)
#   scripts/build.sh PRESET     dev: with the tests; bench: with shapedb-bench too; asan, tsan, fuzz: in build-PRESET/
#   scripts/build.sh --tests    dev          --bench    bench
#   scripts/build.sh --peers    shapedb-bench and what it is measured against (needs install-deps.sh --bench)
#   BUILD_DIR=folder scripts/build.sh ...    builds there instead
set -euo pipefail
cd "$(dirname "$0")/.."

case "${1:-release}" in
  --tests) preset=dev ;;
  --bench) preset=bench ;;
  --peers) preset=peers ;;
  release | dev | bench | peers | asan | tsan | fuzz) preset=${1:-release} ;;
  *) echo "build: unknown preset $1; there are release, dev, bench, peers, asan, tsan and fuzz" >&2; exit 2 ;;
esac
[ $# -le 1 ] || { echo "build: one preset at a time" >&2; exit 2; }
case "$preset" in
  asan | tsan | fuzz) build_dir=${BUILD_DIR:-build-$preset} ;;
  *) build_dir=${BUILD_DIR:-build} ;;
esac

# Paths below this folder count as relative, so that checkouts share what ccache keeps.
export CCACHE_BASEDIR="$PWD"
cmake --preset "$preset" -B "$build_dir"
cmake --build "$build_dir"
