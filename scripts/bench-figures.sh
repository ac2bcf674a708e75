#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Repeats the figures of the first table of docs/retrieval.md, row by row: prints each command, and what it measures.
#   SHAPEDB_DATA=/data scripts/bench-figures.sh [--quick] [ROW...]    all rows by default; --list names them
#   --quick      a few shapes of each folder: shows that every command runs; its figures mean nothing
#   BUILD_DIR=...  folder with the programs [build]; preset bench builds them (scripts/build.sh bench)
# All rows take about 25 minutes on two cores. What stands beside them comes from scripts/bench-retrieval.sh.
set -euo pipefail
cd "$(dirname "$0")/.."
bin=$PWD/${BUILD_DIR:-build}/bin
rows=(models models-noise-0.5 models-noise-1 poses lidar parts twins pieces bunny dragon fused kinect rescans)

quick=
chosen=()
for argument in "$@"; do
  case "$argument" in
    --quick) quick=1 ;;
    --list) printf '%s\n' "${rows[@]}"; exit ;;
    -*) echo "bench-figures: unknown flag $argument" >&2; exit 2 ;;
    *) chosen+=("$argument") ;;
  esac
done
[ ${#chosen[@]} -gt 0 ] || chosen=("${rows[@]}")
: "${SHAPEDB_DATA:?set SHAPEDB_DATA to the folder of docs/data.md}"
data=$(cd "$SHAPEDB_DATA" && pwd)
verdict_flags=()

# few FOLDER COUNT: links to the first COUNT scans of a folder of the data, in the folder we are in.
few() {
  mkdir -p "$1"
  find "$data/$1" -maxdepth 1 -type f | sort | head -n "$2" | while read -r file; do ln -sf "$file" "$1/"; done
}
# fewClasses FOLDER: two scans of each of its first three folders.
fewClasses() {
  find "$data/$1" -mindepth 1 -maxdepth 1 -type d -printf '%f\n' | sort | head -n 3 | while read -r class; do few "$1/$class" 2; done
}
if [ -n "$quick" ]; then
  work=$(mktemp -d)
  trap 'rm -rf "$work"' EXIT
  cd "$work"
  for set in watertight-dev poses-dev lidar-dev parts-dev onesided-dev/bunny onesided-dev/dragon; do fewClasses "$set"; done
  for set in twins-dev/gallery onesided-dev/fused onesided-dev/whole tools-dev/web; do few "$set" 4; done
  few tools-dev/kinect 7
  few tools-dev/artec 14
  for name in bunny dragon $(ls onesided-dev/fused); do ln -sf "$data/onesided-dev/whole/${name%.ply}.ply" onesided-dev/whole/; done
  verdict_flags=(--count 1)
else
  cd "$data"
fi

run() {
  printf '\n$ %s\n' "$*"
  PATH=$bin:$PATH "$@" || { echo "bench-figures: this command failed" >&2; failed=1; }
}
# A row of queries against the gallery of 318, with sizes free and kept.
oneSided() {
  for sizes in "" --keep-scale; do
    run shapedb evaluate "$1" --match stem $sizes \
      --gallery onesided-dev/whole watertight-dev tools-dev/web tools-dev/artec
  done
}

failed=0
for row in "${chosen[@]}"; do
  printf '\n== %s\n' "$row"
  case "$row" in
    models) run shapedb evaluate watertight-dev ;;
    models-noise-0.5) run shapedb evaluate watertight-dev --noise 0.005 ;;
    models-noise-1) run shapedb evaluate watertight-dev --noise 0.01 ;;
    poses) run shapedb evaluate poses-dev ;;
    lidar) run shapedb evaluate lidar-dev ;;
    parts) run shapedb evaluate parts-dev ;;
    twins) run shapedb-bench find twins-dev/gallery --change rescan --no-reflection ;;
    pieces) run shapedb-bench find watertight-dev --change piece65 piece50 --partial ;;
    bunny | dragon | fused) oneSided "onesided-dev/$row" ;;
    kinect) oneSided tools-dev/kinect ;;
    rescans) run shapedb-bench verdicts "${verdict_flags[@]}" ;;
    *) echo "bench-figures: no row $row; --list names them" >&2; exit 2 ;;
  esac
done
exit "$failed"
