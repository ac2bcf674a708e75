#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# From a fresh Debian 12 machine to a first result: installs what is missing, builds, starts a
# server on loopback, uploads sample scans, rebuilds the index and searches with a new, noisy scan.
#   scripts/quickstart.sh          stops the server at the end; its data stays in build/quickstart/
#   scripts/quickstart.sh --keep   leaves the server running
set -euo pipefail
cd "$(dirname "$0")/.."

step() { printf '\n== %s\n' "$1"; }
run() { printf '$ %s\n' "$*" | sed 's#build/bin/##g'; "$@"; }

step "Install packages and build"
scripts/install-deps.sh
echo "building; takes a few minutes the first time (log: build/quickstart-build.log)"
mkdir -p build
if ! scripts/build.sh > build/quickstart-build.log 2>&1; then
  tail -n 40 build/quickstart-build.log >&2
  echo "the build failed; the whole log is build/quickstart-build.log" >&2
  exit 1
fi
echo "built build/bin/shapedbd (server) and build/bin/shapedb (client)"

demo=build/quickstart
rm -rf "$demo"
mkdir -p "$demo/data"

step "Start a server; its database is in $demo/data"
build/bin/shapedbd --listen 127.0.0.1:0 --http-listen 127.0.0.1:0 --data "$demo/data" > "$demo/server.out" 2> "$demo/server.log" &
server=$!
stop_server() { kill -TERM "$server" 2>/dev/null && wait "$server" 2>/dev/null || true; }
trap stop_server EXIT
for _ in $(seq 100); do
  grep -q '^http on ' "$demo/server.out" && break
  kill -0 "$server" 2>/dev/null || { cat "$demo/server.log" >&2; exit 1; }
  sleep 0.1
done
SHAPEDB_SERVER=$(sed -n 's/^listening on //p' "$demo/server.out")
http=$(sed -n 's/^http on //p' "$demo/server.out")
export SHAPEDB_SERVER
run build/bin/shapedb health

step "Make sample scans: 13 families of shapes, noisy, randomly rotated and scaled"
run build/bin/shapedb sample "$demo/scans" --count 4 --points 10000 > /dev/null
ls "$demo/scans" | paste -sd' '

step "Upload and segment"
run build/bin/shapedb add "$demo/scans" --base "$demo/scans" --label-from-folder --wait

step "Rebuild the index from the stored points"
run build/bin/shapedb admin rebuild

step "Search with a new animal, scanned with more noise"
build/bin/shapedb sample "$demo/new" --families animal --first 7 --count 1 --points 10000 --noise 0.004 > /dev/null
run build/bin/shapedb query "$demo"/new/animal/*.ply -k 5

step "The same answer to look at: the hits laid on the query, to be turned in a browser"
run build/bin/shapedb report "$demo"/new/animal/*.ply -k 5 -o "$demo/report.html"

step "The same server speaks HTTP: for curl, and for browsers at $http"
run curl -sS -H 'Content-Type: application/json' -d '{}' "$http/shapedb.v1.ShapeService/CountShapes"
echo

printf '\nThe parts of a scan of your own, coloured, for any viewer of point clouds: build/bin/shapedb segment SCAN --out parts.ply\n'
printf 'What all this means, and a search with your own scan: docs/tutorial.md\n'

if [ "${1:-}" = "--keep" ]; then
  trap - EXIT
  printf '\nThe server is still running at %s and %s (process %s). Try:\n  build/bin/shapedb --server %s list\n' \
    "$SHAPEDB_SERVER" "$http" "$server" "$SHAPEDB_SERVER"
else
  printf '\nTo start the server again with the same data, and look at the shapes at http://127.0.0.1:7879 in a browser:\n  build/bin/shapedbd --listen 127.0.0.1:7878 --http-listen 127.0.0.1:7879 --data %s/data\n' "$demo"
fi
