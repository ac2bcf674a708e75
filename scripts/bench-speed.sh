#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Measures the speeds of docs/benchmarks.md again and saves what the program prints, as text and as JSON, in
# a folder. Builds the programs first, with the peers (install-deps.sh --bench installs what they need). On a
# quiet machine with two cores, segment takes a quarter of an hour, topk an hour and 24 GiB, load half an hour.
#   scripts/bench-speed.sh FOLDER [segment] [topk] [load]     default: all three
#   BUILD_DIR=...  folder to build in [build-bench]
#   BENCH=...      use this shapedb-bench instead of building one; load needs the shapedbd beside it
set -euo pipefail
: "${1:?name a folder for the figures}"
mkdir -p "$1"
folder=$(cd "$1" && pwd)
shift
cd "$(dirname "$0")/.."
parts=("$@")
[ ${#parts[@]} -gt 0 ] || parts=(segment topk load)
for part in "${parts[@]}"; do
  case "$part" in
    segment | topk | load) ;;
    *) echo "bench-speed: unknown part $part; the parts are segment, topk and load" >&2; exit 2 ;;
  esac
done

bench=${BENCH:-}
if [ -z "$bench" ]; then
  build_dir=${BUILD_DIR:-build-bench}
  BUILD_DIR=$build_dir scripts/build.sh --peers
  bench=$build_dir/bin/shapedb-bench
fi

# measure NAME OPERATION OPTIONS...: writes NAME.txt and NAME.json
measure() {
  local name=$1
  shift
  echo "== $name: shapedb-bench $*" >&2
  "$bench" "$@" --json "$folder/$name.json" | tee "$folder/$name.txt"
}

segment() {
  measure segment-120000 segment --points 120000 --repeat 15 --profile paper
  measure segment-1000000 segment --points 1000000 --profile paper --repeat 9
  measure describe-120000 segment --points 120000 --profile default --no-undecimated
  measure describe-1000000 segment --points 1000000 --profile default --no-undecimated --repeat 9
  measure describe-10000000 segment --points 10000000 --profile default --no-undecimated
}
topk() {
  measure topk topk --shapes 1000,10000,100000,1000000
  measure topk-10000000 topk --shapes 10000000 --queries 20
  measure topk-duplicates topk --shapes 1000000 --mixture duplicates --no-peer
  measure topk-hard topk --shapes 1000000 --mixture hard --no-peer
}
load() { measure load load; }

for part in "${parts[@]}"; do "$part"; done
