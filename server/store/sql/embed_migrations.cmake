# SPDX-License-Identifier: GPL-3.0-or-later
# cmake -DFOLDER=migrations/x -DFUNCTION=name -DOUTPUT=x.cpp -P embed_migrations.cmake
# Writes the *.sql files as one C++ array, returned by FUNCTION (server/store/sql/migration.h). Names must be
# NNNN_words.sql, numbered 1, 2, 3 ... without a gap.
file(GLOB FILES ${FOLDER}/*.sql)
list(SORT FILES)
set(expected 0)
set(rows "")
foreach(path IN LISTS FILES)
  math(EXPR expected "${expected} + 1")
  get_filename_component(name ${path} NAME_WE)
  if(NOT name MATCHES "^([0-9][0-9][0-9][0-9])_[a-z0-9_]+$")
    message(FATAL_ERROR "${path}: a migration is named NNNN_words.sql")
  endif()
  math(EXPR number "1${CMAKE_MATCH_1} - 10000")
  if(NOT number EQUAL expected)
    message(FATAL_ERROR "${path}: migration ${expected} is missing or doubled")
  endif()
  file(READ ${path} text)
  string(APPEND rows "        {${number}, \"${name}\", R\"sql(${text})sql\"},\n")
endforeach()
file(WRITE ${OUTPUT} "// Generated from ${FOLDER}/*.sql; do not edit.
#include \"server/store/sql/migration.h\"

namespace shapedb::store {

const std::vector<Migration>& ${FUNCTION}() {
    static const std::vector<Migration> kMigrations = {
${rows}    };
    return kMigrations;
}

}  // namespace shapedb::store
")
