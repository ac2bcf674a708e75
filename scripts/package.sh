#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Builds the Debian packages, with a list of what is linked in each (SPDX), into build/packages/.
#   scripts/package.sh [PRESET]     release by default
#   BUILD_DIR=folder SHAPEDB_COMMIT=hash scripts/package.sh
set -euo pipefail
cd "$(dirname "$0")/.."
build_dir=${BUILD_DIR:-build}
export CCACHE_BASEDIR="$PWD"
cmake --preset "${1:-release}" -B "$build_dir" -D SHAPEDB_COMMIT="${SHAPEDB_COMMIT:-}" > /dev/null
cmake --build "$build_dir" --target shapedbd shapedb_command shapedb_client_installed shapedb_python shapedb_pages shapedb_sbom
# shapedb-doc has the pages as a site too, where there is mkdocs; never one of other sources, made before.
rm -rf "$build_dir/site"
if command -v mkdocs > /dev/null && [ -d /usr/share/mkdocs/themes/material ]; then
  cmake --build "$build_dir" --target shapedb_site
fi
rm -rf "$build_dir/packages"
# Modes of the files are those of the tree: a umask such as 077 must not be packed.
umask 022
(cd "$build_dir" && cpack -G DEB > cpack.log) || { cat "$build_dir/cpack.log" >&2; exit 1; }
rm -rf "$build_dir/packages/_CPack_Packages"
ls "$build_dir"/packages/*.deb
