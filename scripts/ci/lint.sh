#!/usr/bin/env bash
# What can be checked without compiling: format, layers, wiring of tests, file sizes.
set -uo pipefail
cd "$(dirname "$0")/../.."
failed=0
complain() { echo "lint: $1" >&2; failed=1; }

sources() { git ls-files -- '*.h' '*.cpp'; }

unformatted=$(sources | xargs -r clang-format-14 --dry-run -Werror 2>&1 | grep -oE '^[^:]+' | sort -u | grep -E '\.(h|cpp)$')
[ -z "$unformatted" ] || complain "not formatted (clang-format-14 -i): $(echo $unformatted)"

# core/ is the science: no transport, storage, logging or files.
leaks=$(git grep -nE '#include [<"](grpc|google/protobuf|shapedb/v1|sqlite3|spdlog|fstream|filesystem|server/|client/)' -- core)
[ -z "$leaks" ] || complain "core/ includes what it must not know:"$'\n'"$leaks"
leaks=$(git grep -n 'sqlite3\.h' -- server client tests bench ':!server/store/sqlite' ':!tests/server/store/sqlite')
[ -z "$leaks" ] || complain "sqlite3.h outside server/store/sqlite/:"$'\n'"$leaks"
leaks=$(git grep -nE '#include [<"]CGAL' -- 'core/**/*.h')
[ -z "$leaks" ] || complain "CGAL in a public header:"$'\n'"$leaks"
leaks=$(git grep -nE '#include [<"](grpc|google/protobuf|shapedb/v1)' -- client/api/client.h client/api/types.h)
[ -z "$leaks" ] || complain "gRPC or protobuf in a public client header:"$'\n'"$leaks"

# Each area's tests are built from all *_test.cpp below its folders.
for test in $(git ls-files -- '*_test.cpp'); do
  case "$test" in
    tests/core/* | tests/common/* | tests/server/* | tests/client/* | tests/integration/* | tests/bench/*) ;;
    *) complain "$test is in no test program: see tests/CMakeLists.txt" ;;
  esac
done

long=$(sources | xargs -r wc -l | awk '$2 != "total" && $1 > 500 { print $2 " (" $1 " lines)" }')
[ -z "$long" ] || complain "longer than 500 lines: $long"
unfinished=$(git grep -nE 'TODO|FIXME|\bXXX\b|DISABLED_' -- '*.cpp' '*.h')
[ -z "$unfinished" ] || complain "unfinished:"$'\n'"$unfinished"

python3 scripts/constants.py || complain "docs/constants.md does not list the constants of core/ as they are"

[ "$failed" -eq 0 ] && echo "lint: clean"
exit "$failed"
