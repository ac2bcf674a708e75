#!/usr/bin/env bash
# Fuzzes the readers of scan files for a while, with AddressSanitizer and UndefinedBehaviorSanitizer.
#   scripts/ci/fuzz.sh [SECONDS]     60 by default
# What was found to be interesting is kept in build-fuzz/corpus/; an input that fails is left in build-fuzz/.
set -euo pipefail
cd "$(dirname "$0")/../.."
seconds=${1:-60}
scripts/install-deps.sh --analysis
export CCACHE_BASEDIR="$PWD"
cmake --preset fuzz
cmake --build build-fuzz --target shapedb_fuzz_scan_reader
mkdir -p build-fuzz/corpus
build-fuzz/bin/shapedb_fuzz_scan_reader build-fuzz/corpus tests/fuzz/seeds \
  -max_total_time="$seconds" -max_len=4096 -timeout=10 -rss_limit_mb=2048 \
  -artifact_prefix=build-fuzz/ -print_final_stats=1
