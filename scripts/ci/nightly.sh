#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Everything that is too slow for every change. Runs all lanes, even after one has failed, and says which failed.
#   scripts/ci/nightly.sh [LANE]...    sanitize, threads, bench, tidy, fuzz, mutate, reliability, docs, packages; all by default
set -uo pipefail
cd "$(dirname "$0")/../.."
lanes=("$@")
[ ${#lanes[@]} -gt 0 ] || lanes=(sanitize threads bench tidy fuzz mutate reliability docs packages)

# The long counts of docs/reliability.md. Not by ctest, whose limits of time are those of the short ones.
reliability() {
  local tests=${BUILD_DIR:-build}/tests
  scripts/install-deps.sh && scripts/build.sh dev || return 1
  SHAPEDB_TEST_SCALE=40 "$tests/shapedb_reliability_test" --gtest_filter='*PowerLoss*:*IoError*' || return 1
  SHAPEDB_TEST_SCALE=40 "$tests/shapedb_reliability_test" --gtest_filter='*OutOfMemory*' || return 1
  SHAPEDB_TEST_SCALE=20 "$tests/shapedb_reliability_test" --gtest_filter='*Failpoint*' || return 1
  SHAPEDB_TEST_SCALE=20 "$tests/shapedb_server_test" --gtest_filter='*ModelTest*' || return 1
  SHAPEDB_TEST_SCALE=10 ctest --test-dir "${BUILD_DIR:-build}" --output-on-failure -R '^attack\.kill$' || return 1
  SHAPEDB_TEST_SCALE=240 ctest --test-dir "${BUILD_DIR:-build}" --output-on-failure -R '^attack\.soak$'
}

failed=()
for lane in "${lanes[@]}"; do
  echo "== $lane"
  case "$lane" in
    sanitize) scripts/ci/sanitize.sh address,undefined ;;
    threads) scripts/ci/sanitize.sh thread ;;
    bench) scripts/ci/bench.sh ;;
    tidy) scripts/ci/tidy.sh ;;
    fuzz) scripts/ci/fuzz.sh 600 ;;
    # Another part of the mutants each day. Survivors are printed, not failures.
    mutate) scripts/mutate.sh --seed "$(date +%j)" ;;
    reliability) reliability ;;
    docs) scripts/install-deps.sh && scripts/build.sh dev && scripts/documented-commands.py ;;
    packages) scripts/ci/packages.sh ;;
    *) echo "nightly: unknown lane $lane" >&2; exit 2 ;;
  esac || failed+=("$lane")
done
[ ${#failed[@]} -eq 0 ] || { echo "nightly: failed: ${failed[*]}" >&2; exit 1; }
echo "nightly: all lanes passed"
