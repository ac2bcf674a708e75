#!/usr/bin/env bash
# Measures retrieval beside the peers on the public data of docs/data.md and writes tables and plot
# into docs/benchmarks.md and docs/images/. Builds the programs first, with the peers (install-deps.sh --bench).
#   SHAPEDB_DATA=/data scripts/bench-retrieval.sh [OPTIONS OF shapedb-bench retrieval, e.g. --seed 2]
#   BUILD_DIR=...  where to build (build-bench)
#   BENCH=...      this shapedb-bench instead of building one
#   KEEP=...       folder that gets the figures as JSON too
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

# Puts a file between the two marker lines of its name; both markers must be there.
replace() {
  awk -v name="$1" -v file="$2" '
    $0 == "<!-- " name ": begin -->" { print; print ""; while ((getline line < file) > 0) print line; skip = 1; begun = 1 }
    $0 == "<!-- " name ": end -->"   { skip = 0; ended = 1 }
    !skip { print }
    END { exit !(begun && ended) }' docs/benchmarks.md > "$work/page.md" ||
    { echo "bench-retrieval: docs/benchmarks.md has no markers '$1'" >&2; exit 1; }
  cat "$work/page.md" > docs/benchmarks.md
}
replace models "$work/models.md"
replace tools "$work/tools.md"
cp "$work/models.svg" docs/images/retrieval.svg
[ -z "${KEEP:-}" ] || { mkdir -p "$KEEP" && cp "$work"/*.json "$KEEP"/; }
