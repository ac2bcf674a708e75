#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Everything that is too slow for every change. Runs all lanes, even after one has failed, and says which failed.
#   scripts/ci/nightly.sh [LANE]...    sanitize, threads, bench, tidy, fuzz, mutate, reliability, docs, packages; all by default
set -uo pipefail
cd "$(dirname "$0")/../.."
lanes=("$@")
[ ${#lanes[@]} -gt 0 ] || lanes=(sanitize threads bench tidy fuzz mutate reliability docs packages)

build=${BUILD_DIR:-build}

# scaled COUNT PROGRAM FILTER: fails also if no test has such a name, which GoogleTest takes for success.
scaled() {
  if [ -z "$("$build/tests/$2" --gtest_filter="$3" --gtest_list_tests | grep '^  ')" ]; then
    echo "nightly: no test is called $3" >&2
    return 1
  fi
  SHAPEDB_TEST_SCALE=$1 "$build/tests/$2" --gtest_filter="$3"
}

# attack COUNT NAME
attack() {
  SHAPEDB_TEST_SCALE=$1 ctest --test-dir "$build" --output-on-failure --no-tests=error -R "^attack\\.$2\$"
}

# The long counts of docs/reliability.md. Not by ctest, whose limits of time are those of the short ones.
reliability() {
  scripts/install-deps.sh && scripts/install-deps.sh --postgres && scripts/build.sh dev || return 1
  scaled 40 shapedb_reliability_test '*PowerLoss*' || return 1
  scaled 40 shapedb_reliability_test '*IoError*' || return 1
  scaled 40 shapedb_reliability_test '*OutOfMemory*' || return 1
  scaled 20 shapedb_reliability_test '*Failpoint*' || return 1
  scaled 20 shapedb_server_test '*ModelTest*' || return 1
  scaled 20 shapedb_server_test 'ClusterSimulation.*' || return 1
  REQUIRE_POSTGRES=1 scaled 10 shapedb_integration_test 'ClusterTest.AnswersAreThose*' || return 1
  scripts/ci/cluster-mutants.py "$build" || return 1
  attack 10 kill || return 1
  attack 20 shared_kill || return 1
  attack 25 cluster_kill || return 1
  attack 240 soak
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
