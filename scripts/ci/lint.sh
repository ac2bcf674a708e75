#!/usr/bin/env bash
# SPDX-License-Identifier: GPL-3.0-or-later
# What can be checked without compiling: format, layers, licences, test programs, file sizes.
set -uo pipefail
cd "$(dirname "$0")/../.."
failed=0
complain() { echo "lint: $1" >&2; failed=1; }

sources() { git ls-files -- '*.h' '*.cpp'; }
scripts() { git ls-files -- 'web/*.ts' 'web/*.mjs' 'tests/web/*.mjs'; }

unformatted=$(sources | xargs -r clang-format-14 --dry-run -Werror 2>&1 | grep -oE '^[^:]+' | sort -u | grep -E '\.(h|cpp)$')
[ -z "$unformatted" ] || complain "not formatted (clang-format-14 -i): $(echo $unformatted)"

# forbid WHAT REASON PATH...: no include that matches WHAT in the paths.
forbid() {
  local what=$1 reason=$2
  shift 2
  local found
  found=$(git grep -nE "#include [<\"]($what)" -- "$@")
  [ -z "$found" ] || complain "$reason:"$'\n'"$found"
}
transport='grpc|google/protobuf|shapedb/v1'

# core/ is the science: no transport, storage, logging or files.
forbid "$transport|sqlite3|spdlog|fstream|filesystem|server/|client/|bench/" "core/ may not include these" core
# Folders of core/ include only those before them; each line is a folder and the ones it may not include.
later=''
for folder in synthetic evaluation search matching pipeline signature segmentation delaunay views fit preparation geometry base; do
  # Neither is built on the rest.
  case "$folder" in
    synthetic) siblings='delaunay/|views/|fit/|preparation/|segmentation/|signature/|pipeline|matching/|search/|evaluation/|' ;;
    evaluation) siblings='delaunay/|views/|fit/|preparation/|segmentation/|signature/|pipeline|matching/|search/|' ;;
    *) siblings='' ;;
  esac
  paths=(core/$folder)
  [ "$folder" = pipeline ] && paths=(core/pipeline.h core/pipeline.cpp)
  beyond="$siblings$later"
  [ -z "$beyond" ] || forbid "core/(${beyond%|})" "core/$folder may not include a later folder of core/" "${paths[@]}"
  later="$later$folder$([ "$folder" = pipeline ] || echo /)|"
done
forbid 'core/matching/attributed/' "the published score does not know the one with attributes" core/matching/published
forbid 'CGAL' "CGAL in a header that others include" 'core/**/*.h'
forbid 'sqlite3' "sqlite3.h outside server/store/sqlite/" \
  server client tests bench common ':!server/store/sqlite' ':!tests/server/store/sqlite' ':!tests/reliability'
forbid "$transport" "gRPC or protobuf below the transports" server ':!server/rpc' ':!server/http'
forbid 'server/(rpc|catalog|ingest|index|config)/' "the store may not include what is built on it" server/store
forbid 'server/(rpc|http)/' "the transports are the outermost layers" server/catalog server/ingest server/index server/telemetry server/config
forbid 'server/http/' "gRPC does not know who else calls its handlers" server/rpc
forbid 'boost/(asio|beast)' "Boost.Beast outside server/http/" core server client bench common ':!server/http'
forbid 'server/catalog/' "the catalog is built on these" server/ingest server/index server/telemetry
forbid "$transport" "gRPC or protobuf in a public client header" client/api/client.h client/api/shape_types.h client/api/types.h
forbid "$transport|client/(api|cli|io)/" "files of backups know neither gRPC nor the rest of the client" client/backup
forbid 'server/|bench/' "client/ may not include the server" client
forbid 'server/|client/|bench/' "common/ may not include client or server" common

# A program that uses the installed client library finds every header that an installed one includes.
installed=$(sed -n '/^set(installed_core_headers/,/)/p' client/api/CMakeLists.txt | grep -oE '[a-z_/]+\.h' | sed 's#^#core/#')
installed="$installed client/api/client.h client/api/shape_types.h client/api/types.h"
for header in $(grep -hoE '^#include "[^"]+"' $installed | cut -d'"' -f2 | sort -u); do
  case " $(echo $installed) " in
    *" $header "*) ;;
    *) complain "an installed header includes $header, which client/api/CMakeLists.txt does not install" ;;
  esac
done

# Each test program is built from all *_test.cpp below its folders.
for test in $(git ls-files -- '*_test.cpp'); do
  case "$test" in
    tests/core/* | tests/common/* | tests/server/* | tests/client/* | tests/integration/* | tests/reliability/* | tests/bench/*) ;;
    *) complain "$test is in no test program: see tests/CMakeLists.txt" ;;
  esac
done

# Words of strangers become text, never markup (docs/web.md).
markup=$(git grep -nE 'innerHTML|outerHTML|insertAdjacentHTML|document\.write|\beval\(|new Function' -- web/src)
[ -z "$markup" ] || complain "web/src/ makes markup or code of text:"$'\n'"$markup"

lengths=$( (sources; scripts) | xargs -r wc -l | awk '$2 != "total"')
long=$(awk '$1 > 500 { print $2 " (" $1 " lines)" }' <<< "$lengths")
[ -z "$long" ] || complain "longer than 500 lines: $long"
unfinished=$(git grep -nE 'TODO|FIXME|\bXXX\b|DISABLED_' -- '*.cpp' '*.h' '*.ts')
[ -z "$unfinished" ] || complain "unfinished:"$'\n'"$unfinished"

python3 scripts/python-sync.py || complain "the Python client that blocks is not what scripts/python-sync.py --update makes"
scripts/spdx.py --check || complain "licences: see scripts/spdx.py"
python3 scripts/constants.py || complain "docs/constants.md does not list the constants of core/ as they are"

for row in $(scripts/bench-figures.sh --list); do
  grep -q "^| \`$row\` |[^|]*|[^|]*|[^|]*|\$" docs/retrieval.md ||
    complain "the first table of docs/retrieval.md has no row \`$row\`, which scripts/bench-figures.sh repeats"
done

# Not an error: many small files are harder to read than a few.
short=$(awk '$1 < 40 { n++ } END { printf "%d of %d sources are shorter than 40 lines", n, NR }' <<< "$lengths")
[ "$failed" -eq 0 ] && echo "lint: clean ($short)"
exit "$failed"
