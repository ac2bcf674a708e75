#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Builds Debian's oneTBB with ThreadSanitizer into build-tbb-thread/ and prints that folder. The sanitizer cannot
# see how an uninstrumented oneTBB orders its tasks, and reports races between tasks that run one after the other.
set -euo pipefail
cd "$(dirname "$0")/../.."
root="$PWD/build-tbb-thread"
version=$(dpkg-query -W -f='${Version}' libtbb-dev)
if [ "$(cat "$root/version" 2>/dev/null || true)" = "$version" ]; then
  echo "$root"
  exit 0
fi
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
chmod 755 "$work"
mkdir -p "$work/lists/partial"
# The sources are where the packages came from.
[ -n "$(apt-cache policy libtbb-dev | grep ' Packages$')" ] || apt-get -q update >&2
apt-cache policy libtbb-dev |
  awk '$NF == "Packages" { split($3, at, "/"); print "deb-src", $2, at[1], at[2] }' | sort -u > "$work/sources.list"
options=(-q -o "Dir::Etc::SourceList=$work/sources.list" -o Dir::Etc::SourceParts=/dev/null
  -o "Dir::State::Lists=$work/lists" -o APT::Sandbox::User=root)
command -v dpkg-source > /dev/null || apt-get install -y -q --no-install-recommends dpkg-dev >&2
apt-get "${options[@]}" update >&2
(cd "$work" && apt-get "${options[@]}" source "onetbb=$version" >&2)
cmake -S "$work"/onetbb-*/ -B "$work/build" -G Ninja -DCMAKE_BUILD_TYPE=RelWithDebInfo -DTBB_TEST=OFF \
  -DTBB_STRICT=OFF -DTBB_SANITIZE=thread -DCMAKE_INSTALL_PREFIX="$root" >&2
rm -rf "$root"
cmake --build "$work/build" --target install >&2
echo "$version" > "$root/version"
echo "$root"
