#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Measures retrieval beside the peers on the public data of docs/data.md, and writes the tables into
# docs/benchmarks.md and the plot into docs/images/. Builds the programs first, with the peers
# (install-deps.sh --bench installs what they need).
#   SHAPEDB_DATA=/data scripts/bench-retrieval.sh [OPTIONS OF shapedb-bench retrieval, e.g. --seed 2]
#   BUILD_DIR=...  folder to build in [build-bench]
#   BENCH=...      use this shapedb-bench instead of building one
#   KEEP=...       also save the figures as JSON in this folder
set -euo pipefail
cd "$(dirname "$0")/.."
: "${SHAPEDB_DATA:?set SHAPEDB_DATA to the folder of docs/data.md}"

bench=${BENCH:-}
if [ -z "$bench" ]; then
  build_dir=${BUILD_DIR:-build-bench}
  BUILD_DIR=$build_dir scripts/build.sh --peers
  bench=$build_dir/bin/shapedb-bench
fi

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir -p docs/images
"$bench" retrieval "$SHAPEDB_DATA/watertight-dev" "$@" \
  --markdown "$work/models.md" --plot "$work/models.svg" --json "$work/models.json"
"$bench" retrieval "$SHAPEDB_DATA/tools-dev/kinect" --match stem \
  --gallery "$SHAPEDB_DATA/tools-dev/artec" "$SHAPEDB_DATA/tools-dev/web" "$@" \
  --markdown "$work/tools.md" --json "$work/tools.json"

# Replaces what stands between the two marker lines of this name by a file. Both must exist.
replace() {
  awk -v name="$1" -v file="$2" '
    $0 == "<!-- " name ": begin -->" { print; print ""; while ((getline line < file) > 0) print line; skip = 1; begun = 1 }
    $0 == "<!-- " name ": end -->"   { skip = 0; ended = 1 }
    !skip { print }
    END { exit !(begun && ended) }' docs/benchmarks.md > "$work/page.md" ||
    { echo "bench-retrieval: docs/benchmarks.md lacks the markers '$1'" >&2; exit 1; }
  cat "$work/page.md" > docs/benchmarks.md
}
replace models "$work/models.md"
replace tools "$work/tools.md"
cp "$work/models.svg" docs/images/retrieval.svg
[ -z "${KEEP:-}" ] || { mkdir -p "$KEEP" && cp "$work"/*.json "$KEEP"/; }
