// SPDX-License-Identifier: GPL-3.0-or-later
// The SQL that only a database in a file has, as server/store/sql/sql.h.
#pragma once

#include "server/store/sql/sql.h"

namespace shapedb::store::sqlite_sql {

#define STATEMENT(name, text) inline constexpr char name[] = text;
#include "server/store/sqlite/sqlite_statements.inc"
#undef STATEMENT

inline constexpr sql::Statement kStatements[] = {
#define STATEMENT(name, text) {#name, name},
#include "server/store/sqlite/sqlite_statements.inc"
#undef STATEMENT
};

}  // namespace shapedb::store::sqlite_sql
