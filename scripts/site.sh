#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Builds the documentation as a site in build/site/, for any web server; nothing in it is loaded from elsewhere. It can be read from
# that folder too, but browsers let it search only when it is served. A link or page of the navigation that leads nowhere is an error.
#   scripts/site.sh [FOLDER]    into another folder
#   scripts/site.sh --serve     at http://127.0.0.1:8000, built again when a page changes
set -euo pipefail
cd "$(dirname "$0")/.."
command -v mkdocs >/dev/null && [ -d /usr/share/mkdocs/themes/material ] ||
  { echo "site: mkdocs and mkdocs-material are missing: scripts/install-deps.sh installs them" >&2; exit 1; }
# Debian's packages belong to Debian's Python. The hooks are a module for mkdocs.yml too.
mkdocs() { PYTHONPATH=scripts PYTHONDONTWRITEBYTECODE=1 /usr/bin/python3 -m mkdocs "$@"; }

case "${1:-}" in
  --serve) mkdocs serve --dev-addr 127.0.0.1:8000 ;;
  *)
    target=$(realpath -m "${1:-build/site}")
    printed=$(mkdocs build --strict --clean --site-dir "$target" 2>&1) || { grep -v '^INFO' <<< "$printed" >&2; exit 1; }
    # They need the address of the site.
    find "$target" \( -name 'sitemap.xml*' -o -name 404.html \) -delete
    echo "the site is $target/index.html"
    ;;
esac
