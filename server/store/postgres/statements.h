// SPDX-License-Identifier: GPL-3.0-or-later
// The statements of server/store/sql/sql.h that read otherwise on PostgreSQL.
#pragma once

#include <chrono>
#include <string>

#include "server/store/postgres/connection.h"
#include "server/store/sql/sql.h"

namespace shapedb::store {

/// `serverName` owns the jobs that are claimed, for `lease` from then on.
[[nodiscard]] StatementTexts postgresStatements(const std::string& serverName,
                                                std::chrono::milliseconds lease);

}  // namespace shapedb::store
