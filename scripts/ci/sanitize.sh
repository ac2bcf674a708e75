#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# All tests under sanitizers: scripts/ci/sanitize.sh [address,undefined | thread] [CTEST OPTIONS]
set -euo pipefail
cd "$(dirname "$0")/../.."
kind=${1:-address,undefined}
[ $# -eq 0 ] || shift
case "$kind" in
  address,undefined) preset=asan ;;
  thread) preset=tsan ;;
  *) echo "sanitize: unknown sanitizer $kind; there are address,undefined and thread" >&2; exit 2 ;;
esac
scripts/install-deps.sh --analysis
if [ "$preset" = tsan ]; then
  TBB_ROOT=$(scripts/ci/tbb-for-thread-sanitizer.sh)
  export TBB_ROOT
fi
BUILD_DIR="build-$preset" scripts/build.sh "$preset"
# One test requests more memory than there is, on purpose.
ASAN_OPTIONS="allocator_may_return_null=1 ${ASAN_OPTIONS:-}" \
TSAN_OPTIONS="suppressions=$PWD/scripts/ci/tsan.supp ignore_noninstrumented_modules=1 ${TSAN_OPTIONS:-}" \
  ctest --test-dir "build-$preset" --output-on-failure --timeout 3600 -j "$(nproc)" "$@"
