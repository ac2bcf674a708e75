// SPDX-License-Identifier: GPL-3.0-or-later
// The statements of server/store/sql/sql.h that read otherwise on PostgreSQL.
#pragma once

#include <chrono>
#include <string>

#include "server/store/postgres/connection.h"
#include "server/store/sql/sql.h"

namespace shapedb::store {

// What kLoadIndex selects, before its order. That all tables begin after ?2 is said of each: PostgreSQL would
// read the others from their beginning where it merges them, longer with every page.
#define SHAPEDB_INDEX_PAGE                                                                                  \
    "SELECT " SHAPEDB_INDEX_COLUMNS                                                                         \
    " FROM shape s JOIN signature g ON g.shape_id = s.id AND g.generation = ?3 AND g.shape_id > ?2 LEFT "   \
    "JOIN shape_metadata m ON m.shape_id = s.id AND m.shape_id > ?2 WHERE s.collection_id = ?1 AND s.id > " \
    "?2"

/// `serverName` owns the jobs that are claimed, for `lease` from then on.
[[nodiscard]] StatementTexts postgresStatements(const std::string& serverName,
                                                std::chrono::milliseconds lease);

/// `text` as a literal of SQL.
[[nodiscard]] std::string sqlLiteral(const std::string& text);

}  // namespace shapedb::store
