#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# Mutation test: changes one line of a source at a time and checks that a test fails. Works on a copy of the tree.
#   scripts/mutate.sh [--count N] [--seed N] [--folder FOLDER]...
#     --count    mutants for each folder (40)
#     --seed     which (1); another seed chooses others
#     --folder   core/matching, core/search or server/store; all three by default
#   SCRATCH=folder   the copy and its build (build-mutate); kept, so that the next run starts warm
#   TIMEOUT=seconds  for the tests of one mutant (300); running out of it counts as killed
# Prints the share killed and the survivors, each of which is either a missing test or a change without effect.
set -euo pipefail
cd "$(dirname "$0")/.."

count=40
seed=1
folders=()
while [ $# -gt 0 ]; do
  case "$1" in
    --count) count=${2:?}; shift 2 ;;
    --seed) seed=${2:?}; shift 2 ;;
    --folder) folders+=("${2:?}"); shift 2 ;;
    *) echo "mutate: unknown option $1; see the head of this script" >&2; exit 2 ;;
  esac
done
[ ${#folders[@]} -gt 0 ] || folders=(core/matching core/search server/store)
scratch=${SCRATCH:-build-mutate}
time_limit=${TIMEOUT:-300}

# The test program of a folder and the test folders that are to notice.
program_of() { case "$1" in core/*) echo shapedb_core_test ;; server/*) echo shapedb_server_test ;; esac; }
tests_of() {
  case "$1" in
    core/matching) echo tests/core/matching tests/core/search ;;
    core/search) echo tests/core/search ;;
    server/store) echo tests/server/store ;;
    *) echo "mutate: no tests are known for $1" >&2; exit 2 ;;
  esac
}
filter_of() {
  git ls-files -- $(tests_of "$1") | grep '_test\.cpp$' |
    xargs sed -nE 's/^(TEST|TEST_F|TEST_P)\((\w+),.*/\2/p' | sort -u | sed 's#.*#&.*:*/&.*#' | paste -sd:
}

mkdir -p "$scratch"
scratch=$(cd "$scratch" && pwd)
export CCACHE_BASEDIR="$scratch"
# What git knows, as it is now; times are kept, so that little is compiled again.
git ls-files -z | xargs -0 cp -pu --parents -t "$scratch"
(cd "$scratch" && cmake --preset dev -B build > /dev/null)

build() { cmake --build "$scratch/build" --target "$1" > "$scratch/build.log" 2>&1; }
run_tests() {
  timeout "$time_limit" "$(find "$scratch/build/tests" -name "$1" -type f)" --gtest_filter="$2" --gtest_fail_fast \
    --gtest_brief=1 > "$scratch/test.log" 2>&1
}

killed=0
survived=0
invalid=0
survivors=()
for folder in "${folders[@]}"; do
  program=$(program_of "$folder")
  filter=$(filter_of "$folder")
  sources=$(git ls-files -- "$folder/*.cpp")
  build "$program" || { cat "$scratch/build.log" >&2; exit 1; }
  run_tests "$program" "$filter" || { cat "$scratch/test.log" >&2; echo "mutate: the tests fail unchanged" >&2; exit 1; }
  while IFS=$'\t' read -r file line operator changed; do
    original="$scratch/$file"
    cp -p "$original" "$scratch/original"
    printf '%s\n' "$changed" > "$scratch/changed"
    awk -v at="$line" -v file="$scratch/changed" 'NR == at { getline text < file; print text; next } { print }' \
      "$scratch/original" > "$original"
    if ! build "$program"; then
      verdict=invalid
      invalid=$((invalid + 1))
    elif run_tests "$program" "$filter"; then
      verdict=SURVIVED
      survived=$((survived + 1))
      survivors+=("$file:$line: $operator: $changed")
    else
      verdict=killed
      killed=$((killed + 1))
    fi
    echo "$verdict $file:$line $operator"
    # With a new time, or the build would take the mutant's object for up to date.
    cp "$scratch/original" "$original"
  done < <(cd "$scratch" && scripts/mutations.pl "$seed" "$count" $sources)
done

echo
echo "killed $killed of $((killed + survived)); $invalid more did not compile"
[ ${#survivors[@]} -eq 0 ] || { echo "survivors:"; printf '  %s\n' "${survivors[@]}"; }
