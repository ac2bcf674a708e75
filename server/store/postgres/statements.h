// SPDX-License-Identifier: GPL-3.0-or-later
// The statements of server/store/sql/sql.h that read otherwise on PostgreSQL.
#pragma once

#include <chrono>
#include <string>

#include "server/store/postgres/connection.h"

namespace shapedb::store {

/// `serverName` owns the jobs that are claimed, for `lease` from then on.
[[nodiscard]] StatementTexts postgresStatements(const std::string& serverName,
                                                std::chrono::milliseconds lease);

/// `text` as a literal of SQL.
[[nodiscard]] std::string sqlLiteral(const std::string& text);

}  // namespace shapedb::store
