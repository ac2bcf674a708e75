#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# The Debian packages as an administrator meets them, in a minimal Debian 12 of their own: lintian, installation, service,
# upgrade, removal, purge; then the container image. As root; needs Debian's mirror.
#   scripts/ci/packages.sh [--keep-packages]      takes build/packages/ as it is instead of building it
set -euo pipefail
cd "$(dirname "$0")/../.."
source=$PWD
build_dir=$(realpath -m "${BUILD_DIR:-build}")
packages=$build_dir/packages
scripts/install-deps.sh --packages
[ "${1:-}" = --keep-packages ] || BUILD_DIR="$build_dir" scripts/package.sh

root=$build_dir/package-test
fail() { echo "packages: $1" >&2; exit 1; }
inside() { chroot "$root" env -i PATH=/usr/sbin:/usr/bin:/sbin:/bin DEBIAN_FRONTEND=noninteractive LC_ALL=C.UTF-8 "$@"; }
server=''
clean_up() {
  [ -z "$server" ] || kill "$server" 2> /dev/null || true
  # mmdebstrap may leave one of its own below ours. Nothing is deleted through either.
  while mountpoint -q "$root/proc"; do umount --lazy "$root/proc"; done
  rm -rf --one-file-system "$root"
}
trap clean_up EXIT
clean_up

lintian --fail-on error "$packages"/*.deb || fail "lintian complains"

mirror=$(apt-cache policy base-files | awk '$NF == "Packages" && $2 ~ /^http/ { print $2; exit }')
mmdebstrap --quiet --variant=apt --include=systemd-standalone-sysusers bookworm "$root" "${mirror:-http://deb.debian.org/debian}"
mount -t proc proc "$root/proc"
mkdir "$root/packages"
cp "$packages"/*.deb "$root/packages"
# No service is started here, and there is no terminal for a log.
printf '#!/bin/sh\nexit 101\n' > "$root/usr/sbin/policy-rc.d"
chmod 755 "$root/usr/sbin/policy-rc.d"
echo 'Dpkg::Use-Pty "0";' > "$root/etc/apt/apt.conf.d/no-terminal"
install_packages() { inside sh -c 'apt-get install -y -q --no-install-recommends "$@" > /var/log/install.log 2>&1 || { cat /var/log/install.log; exit 1; }' sh "$@"; }

echo "== installation"
inside apt-get update -q > /dev/null
file_of() { (cd "$root" && ls packages/"$1"_*.deb | sed 's#^#/#'); }
install_packages $(for name in shapedb-server shapedb-client python3-shapedb shapedb-doc; do file_of "$name"; done)
inside getent passwd shapedb | grep -q ':/var/lib/shapedb:' || fail "there is no user shapedb"
[ "$(inside stat -c '%U %a' /var/lib/shapedb)" = "shapedb 700" ] || fail "/var/lib/shapedb is not the service's own"
[ -L "$root/etc/systemd/system/multi-user.target.wants/shapedbd.service" ] || fail "the service is not enabled"
[ -s "$root/usr/share/doc/shapedb-server/shapedb-server.spdx.json" ] || fail "there is no list of what is linked"

echo "== server, command, Python"
serve() {
  chroot --userspec=shapedb:shapedb "$root" /usr/bin/shapedbd --config /etc/shapedb/shapedbd.toml > "$root/server.out" 2> "$root/server.log" &
  server=$!
  for _ in $(seq 100); do
    ! grep -q '^listening on ' "$root/server.out" || return 0
    sleep 0.1
  done
  cat "$root/server.log" >&2
  fail "the server does not start"
}
stop() { kill -TERM "$server" && wait "$server" || fail "the server does not stop cleanly"; server=''; }
# Any free port: other servers of this machine share its network.
port=$(/usr/bin/python3 -c 'import socket; s = socket.socket(); s.bind(("127.0.0.1", 0)); print(s.getsockname()[1])')
sed -i "s/^listen = \"127.0.0.1:7878\"/listen = \"127.0.0.1:$port\"/" "$root/etc/shapedb/shapedbd.toml"
client() { inside env SHAPEDB_SERVER="127.0.0.1:$port" "$@"; }
serve
client shapedb health
client shapedb sample /tmp/scans --families animal,mug --count 1 --points 2000 > /dev/null
client shapedb add /tmp/scans --base /tmp/scans --wait
client shapedb query /tmp/scans/animal/animal_01.ply -k 1 | grep -q 'animal/animal_01' || fail "a shape does not find itself"
client python3 -c "import shapedb; print(shapedb.__version__, shapedb.Client('127.0.0.1:$port').collection().count(), 'shapes from Python')"
stop

echo "== upgrade"
install_packages --reinstall "$(file_of shapedb-server)"
grep -q "127.0.0.1:$port" "$root/etc/shapedb/shapedbd.toml" || fail "an upgrade has changed the configuration"
serve
client shapedb list | grep -q animal_01 || fail "the shapes are gone after an upgrade"
stop

echo "== removal, purge"
inside apt-get remove -y -q shapedb-server > /dev/null
[ -e "$root/etc/shapedb/shapedbd.toml" ] || fail "a removal takes the configuration"
inside apt-get purge -y -q shapedb-server > /dev/null
[ ! -e "$root/etc/shapedb" ] || fail "a purge leaves /etc/shapedb"
[ -s "$root/var/lib/shapedb/shapedb.sqlite" ] || fail "a purge has deleted the scans"
install_packages "$(file_of shapedb-server)"
inside env SHAPEDB_PURGE_DATA=yes apt-get purge -y -q shapedb-server > /dev/null
[ ! -e "$root/var/lib/shapedb" ] || fail "a purge leaves the scans though they were to be deleted"

echo "== a program against libshapedb-dev"
dpkg-deb -x "$packages"/libshapedb-dev_*.deb "$root/dev"
cmake -S tests/client/installed -B "$root/program" -G Ninja -D CMAKE_PREFIX_PATH="$root/dev/usr" -D QUICK="$source/client/examples/quick.cpp" > /dev/null
cmake --build "$root/program" > /dev/null
[ "$("$root/program/program")" = unavailable ] || fail "the program does not run"

echo "== container image"
scripts/image.sh --packages "$packages"
echo "packages: all good"
