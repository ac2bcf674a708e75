#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Installs the Debian 12 packages that ShapeDB needs, and only those that are missing.
#   scripts/install-deps.sh             everything to build, test and check, the Python package too, and the npm
#                                       packages of web/, as do all but --open3d
#   scripts/install-deps.sh --analysis  that, and clang for scripts/ci/tidy.sh, fuzz.sh and sanitize.sh
#   scripts/install-deps.sh --build     only what is needed to build
#   scripts/install-deps.sh --packages  everything to build, and what scripts/ci/packages.sh needs
#   scripts/install-deps.sh --postgres  everything to build, and the PostgreSQL server that tests of its store start
#   scripts/install-deps.sh --open3d    Open3D, for client/python/examples/open3d_interop.py and its test
#   scripts/install-deps.sh --bench     everything to build, and the Point Cloud Library and FAISS, which
#                                       shapedb-bench measures too (preset peers)
set -euo pipefail

build_packages=(
  ca-certificates g++ cmake ninja-build ccache mold pkg-config git
  libcgal-dev libgmp-dev libmpfr-dev libeigen3-dev libtbb-dev libexpected-dev
  libgrpc++-dev libprotobuf-dev protobuf-compiler protobuf-compiler-grpc
  libsqlite3-dev libpq-dev libzstd-dev libssl-dev libboost-dev libspdlog-dev libtomlplusplus-dev prometheus-cpp-dev
  libcli11-dev nlohmann-json3-dev libpng-dev liblzf-dev zlib1g-dev libzip-dev libexpat1-dev
  libgtest-dev libgmock-dev clang-format-14 valgrind curl
  python3-grpcio python3-protobuf openssl
)
python_packages=(
  python3-numpy python3-matplotlib python3-pandas
  python3-pytest python3-hypothesis python3-mypy python3-build python3-pip python3-setuptools python3-wheel
)
docs_packages=(mkdocs mkdocs-material python3-pymdownx)
open3d_packages=(python3-open3d)
browser_packages=(chromium)
# Node may come from elsewhere than Debian, and then brings its own npm.
command -v node >/dev/null || build_packages+=(nodejs)
command -v npm >/dev/null || build_packages+=(npm)
analysis_packages=(clang-14 clang-tidy-14 libclang-rt-14-dev)
packages_packages=(buildah groff lintian mmdebstrap)
postgres_packages=(postgresql-15)
bench_packages=(libpcl-dev libfaiss-dev libopenblas-dev)

case "${1:-}" in
  "") packages=("${build_packages[@]}" "${python_packages[@]}" "${docs_packages[@]}" "${browser_packages[@]}") ;;
  --analysis) packages=("${build_packages[@]}" "${python_packages[@]}" "${docs_packages[@]}" "${browser_packages[@]}" "${analysis_packages[@]}") ;;
  --build) packages=("${build_packages[@]}") ;;
  --packages) packages=("${build_packages[@]}" "${packages_packages[@]}") ;;
  --postgres) packages=("${build_packages[@]}" "${postgres_packages[@]}") ;;
  --open3d) packages=("${open3d_packages[@]}") ;;
  --bench) packages=("${build_packages[@]}" "${bench_packages[@]}") ;;
  *) echo "install-deps: unknown option $1; there are --build, --analysis, --bench, --packages, --postgres and --open3d" >&2; exit 2 ;;
esac

# Exactly what web/package-lock.json names, and no script of any package is run.
install_npm_packages() {
  local web
  web=$(dirname "$0")/../web
  case "${1:-}" in --open3d) return 0 ;; esac
  [ -f "$web/package-lock.json" ] || return 0
  [ "$web/node_modules/.package-lock.json" -nt "$web/package-lock.json" ] && return 0
  (cd "$web" && npm ci --ignore-scripts --no-audit --no-fund) >&2 ||
    echo "install-deps: npm's registry cannot be reached: the web page will not be built, nor tested" >&2
}

missing=()
for package in "${packages[@]}"; do
  if [ "$(dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null || true)" != installed ]; then
    missing+=("$package")
  fi
done
if [ ${#missing[@]} -eq 0 ]; then
  install_npm_packages "$@"
  exit 0
fi

as_root=()
if [ "$(id -u)" -ne 0 ]; then
  command -v sudo >/dev/null || { echo "install-deps: run as root or install sudo; missing: ${missing[*]}" >&2; exit 1; }
  as_root=(sudo)
fi
echo "installing ${#missing[@]} packages: ${missing[*]}" >&2
"${as_root[@]}" apt-get update -q >&2
"${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get install -y -q --no-install-recommends "${missing[@]}" >&2
install_npm_packages "$@"
