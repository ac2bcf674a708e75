#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Fuzzes everything that reads bytes of strangers, with AddressSanitizer and UndefinedBehaviorSanitizer.
#   scripts/ci/fuzz.sh [SECONDS] [TARGET...]     60 seconds each by default; the targets are tests/fuzz/TARGET_fuzz.cpp
# What was found to be interesting is kept in build-fuzz/corpus/TARGET; an input that fails is left in build-fuzz/.
# FUZZ_KEEP=1 adds it, without what says the same, to tests/fuzz/corpus/TARGET, to be committed.
set -euo pipefail
cd "$(dirname "$0")/../.."
seconds=${1:-60}
targets=("${@:2}")
if [ ${#targets[@]} -eq 0 ]; then
  for source in tests/fuzz/*_fuzz.cpp; do targets+=("$(basename "$source" _fuzz.cpp)"); done
fi
scripts/install-deps.sh --analysis
export CCACHE_BASEDIR="$PWD"
# Of one allocation for all memory of a target: a corpus file must not make it exceed this.
export ASAN_OPTIONS=allocator_may_return_null=1
cmake --preset fuzz
cmake --build build-fuzz --target shapedb_fuzz
for target in "${targets[@]}"; do
  corpus=build-fuzz/corpus/$target
  committed=tests/fuzz/corpus/$target
  mkdir -p "$corpus" "$committed"
  log=build-fuzz/$target.log
  build-fuzz/bin/shapedb_fuzz_"$target" "$corpus" "$committed" \
    -max_total_time="$seconds" -max_len=4096 -timeout=20 -rss_limit_mb=3072 \
    -artifact_prefix=build-fuzz/"$target"- -print_final_stats=1 -verbosity=0 >"$log" 2>&1 ||
    { cat "$log" >&2; echo "fuzz: $target failed" >&2; exit 1; }
  echo "fuzz: $target, $(sed -n 's/^stat::number_of_executed_units: *//p' "$log") inputs"
  if [ -n "${FUZZ_KEEP:-}" ]; then
    build-fuzz/bin/shapedb_fuzz_"$target" -merge=1 "$committed" "$corpus" -verbosity=0
  fi
done
rm -f /dev/shm/shapedb-fuzz-*
echo "fuzz: nothing found in ${#targets[@]} targets, $seconds s each"
