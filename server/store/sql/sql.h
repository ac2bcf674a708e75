// SPDX-License-Identifier: GPL-3.0-or-later
// The SQL of the store. Each constant's address is its key in a connection's statement cache.
//
// The texts are in sql_statements.inc, so that kStatements lists them all: a test reads the query plan of
// each and allows only the statements it names to read a whole table.
#pragma once

#include <string>

namespace shapedb::store::sql {

// Columns 0 to 16 in the order `readShape` and `forEachShape` (rows.h) expect: one row per metadata entry, so
// that one statement lists shapes and their metadata.
#define SHAPEDB_SHAPE_COLUMNS                                                                             \
    "s.id, s.collection_id, s.key, s.version, s.points_version, s.state, s.point_count, "                 \
    "s.checksum, s.created_at, s.updated_at, s.failure_code, s.failure_message, s.origin_x, s.origin_y, " \
    "s.origin_z, m.name, m.value"
#define SHAPEDB_FROM_SHAPE " FROM shape s LEFT JOIN shape_metadata m ON m.shape_id = s.id "

// Columns 0 to 8 in the order `readIndexRows` (rows.h) expects, in order of s.id: one row per metadata entry.
#define SHAPEDB_INDEX_COLUMNS \
    "s.id, m.name, m.value, g.points_version, g.generation, g.digest, g.bytes, g.views, s.key"

/// The name of a collection that is being imported begins so. No client can give it or ask for it.
inline constexpr char kImporting[] = ".import";
/// The names of collections that were deleted and of which rows are left begin so; the id follows.
inline constexpr char kDeletedPrefix[] = ".deleted-";
/// Whether a collection with the name in `column` is one of these, which are not there for clients.
#define SHAPEDB_HIDDEN(column) \
    "(substr(" column ", 1, 7) = '.import' OR substr(" column ", 1, 9) = '.deleted-')"
inline bool isDeleted(const std::string& name) { return name.rfind(kDeletedPrefix, 0) == 0; }
inline bool isHidden(const std::string& name) { return name.rfind(kImporting, 0) == 0 || isDeleted(name); }

#define STATEMENT(name, text) inline constexpr char name[] = text;
#include "server/store/sql/sql_statements.inc"
#undef STATEMENT

struct Statement {
    const char* name;
    const char* text;
};

inline constexpr Statement kStatements[] = {
#define STATEMENT(name, text) {#name, name},
#include "server/store/sql/sql_statements.inc"
#undef STATEMENT
};

}  // namespace shapedb::store::sql
