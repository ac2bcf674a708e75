#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Makes the container image of docker/Dockerfile with buildah, which needs neither Docker nor its daemon, and tries it.
#   scripts/image.sh                 the base is made of Debian's packages by mmdebstrap
#   scripts/image.sh --pull          the base is debian:12-slim of Docker Hub
#   scripts/image.sh --packages DIR  takes the packages from there instead of building them (scripts/package.sh)
# The image is left as build/image/shapedb.tar, for `docker load` and `podman load`. Needs root and the packages buildah
# and mmdebstrap.
set -euo pipefail
cd "$(dirname "$0")/.."
root=$PWD
build_dir=$(realpath -m "${BUILD_DIR:-build}")
packages='' base=localhost/debian:12
while [ $# -gt 0 ]; do
  case "$1" in
    --pull) base=docker.io/library/debian:12-slim ;;
    --packages) packages=$(realpath "$2"); shift ;;
    *) echo "image: unknown option $1; there are --pull and --packages DIR" >&2; exit 2 ;;
  esac
  shift
done
for program in buildah mmdebstrap; do
  command -v "$program" > /dev/null || { echo "image: $program is missing: apt-get install $program" >&2; exit 1; }
done
if [ -z "$packages" ]; then
  BUILD_DIR="$build_dir" scripts/package.sh
  packages=$build_dir/packages
fi

work=$build_dir/image
mkdir -p "$work"
# Storage of its own: nothing of this is left among the images of the machine. chroot asks least of the machine.
images() { buildah --root "$work/storage" --runroot "$work/run" --storage-driver vfs "$@"; }
container='' server=''
# buildah hands no signals on.
stop() {
  [ -n "$server" ] || return 0
  run sh -c 'kill -TERM "$(cat /tmp/shapedbd.pid)"' && wait "$server" || { echo "image: the server does not stop cleanly" >&2; exit 1; }
  server=''
}
clean_up() {
  trap - EXIT
  (stop) || true
  [ -z "$container" ] || images rm "$container" > /dev/null
  images rm --all > /dev/null
  images rmi --all --force > /dev/null
  rm -rf "$work/storage" "$work/run" "$work/base" "$work/data"
}
trap clean_up EXIT

if [ "$base" = localhost/debian:12 ]; then
  mkdir -p "$work/base"
  mirror=$(apt-cache policy base-files | awk '$NF == "Packages" && $2 ~ /^http/ { print $2; exit }')
  # Without manuals and translations, as in debian:12-slim.
  mmdebstrap --quiet --variant=minbase --dpkgopt='path-exclude=/usr/share/man/*' --dpkgopt='path-exclude=/usr/share/locale/*' \
    bookworm "$work/base/root.tar" "${mirror:-http://deb.debian.org/debian}"
  printf 'FROM scratch\nADD root.tar /\n' > "$work/base/Dockerfile"
  images build --quiet --isolation chroot --tag "$base" "$work/base" > /dev/null
  rm "$work/base/root.tar"
fi
# The format that knows health checks.
images build --format docker --isolation chroot --build-arg BASE="$base" --build-context packages="$packages" \
  --file docker/Dockerfile --tag shapedb "$root"

# What it is for: it starts, says that it serves, and keeps what it was given.
container=$(images from --pull-never shapedb)
rm -rf "$work/data"
install -d -o 10001 -g 10001 "$work/data"
run() { images run --isolation chroot --user shapedb --volume "$work/data:/var/lib/shapedb" "$container" -- "$@"; }
start() {
  # `buildah run` takes no entry point, and its processes share the network of the machine.
  run sh -c 'echo $$ > /tmp/shapedbd.pid; exec env SHAPEDB_LISTEN=127.0.0.1:0 shapedbd' > "$work/server.log" 2>&1 &
  server=$!
  for _ in $(seq 100); do
    kill -0 "$server" 2> /dev/null || break
    if grep -q '^listening on ' "$work/server.log"; then
      run shapedb health
      return 0
    fi
    sleep 0.2
  done
  server=''
  cat "$work/server.log" >&2
  echo "image: the server does not answer" >&2
  exit 1
}
run shapedbd --version
start
run sh -c 'shapedb sample /tmp/scans --count 1 --families animal --points 2000 --json > /dev/null && shapedb add /tmp/scans --base /tmp/scans --wait'
stop
start
run shapedb list | grep -q animal || { echo "image: the shape is gone after a restart" >&2; exit 1; }
stop
images push --quiet shapedb "docker-archive:$work/shapedb.tar.new:shapedb:latest"
mv "$work/shapedb.tar.new" "$work/shapedb.tar"
echo "image: $work/shapedb.tar"
