#!/usr/bin/env bash
# All tests under sanitizers: scripts/ci/sanitize.sh [address,undefined | thread]
set -euo pipefail
cd "$(dirname "$0")/../.."
kind=${1:-address,undefined}
scripts/install-deps.sh
if [ "$kind" = thread ]; then
  TBB_ROOT=$(scripts/ci/tbb-for-thread-sanitizer.sh)
  export TBB_ROOT
fi
BUILD_DIR="build-${kind//,/-}" BUILD_TYPE=RelWithDebInfo SANITIZE="$kind" scripts/build.sh --tests
# One test asks for more memory than there is, and means it.
ASAN_OPTIONS="allocator_may_return_null=1 ${ASAN_OPTIONS:-}" \
TSAN_OPTIONS="suppressions=$PWD/scripts/ci/tsan.supp ignore_noninstrumented_modules=1 ${TSAN_OPTIONS:-}" \
  ctest --test-dir "build-${kind//,/-}" --output-on-failure --timeout 1800 -j "$(nproc)"
