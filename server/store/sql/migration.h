// SPDX-License-Identifier: GPL-3.0-or-later
// Migrations: the numbered files of migrations/, compiled in. They only go forward, and are never edited
// after release: the database records the SHA-256 of each one that it has applied, in the table
// schema_migration.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "server/store/sql/connection.h"

namespace shapedb::store {

struct Migration {
    int number;        ///< 1, 2, 3, ...
    const char* name;  ///< file name without extension
    const char* sql;
};

/// Compares the record with the migrations of this program; returns how many are applied. Throws Failure:
/// - kSchemaTooNew: the database has a migration that `migrations` lacks;
/// - kDataLoss: a migration was edited after it was applied, or the record has a gap.
std::size_t verifyMigrations(Connection& connection, const std::vector<Migration>& migrations);

/// Adds the migration to the record, in the caller's transaction.
void recordMigration(Connection& connection, const Migration& migration, std::int64_t nowMs);

}  // namespace shapedb::store
