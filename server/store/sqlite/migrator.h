// SPDX-License-Identifier: GPL-3.0-or-later
// Brings a database to the schema of this program.
//
// Each migration is applied in its own transaction.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "server/store/sql/migration.h"
#include "server/store/sqlite/connection.h"

namespace shapedb::store {

/// PRAGMA application_id of every database of ours: "ShDB". Persisted.
constexpr std::int64_t kApplicationId = 0x53684442;
/// PRAGMA page_size. Persisted: restore copies pages, so that all files must agree.
constexpr std::int64_t kPageSize = 4096;

/// Those of the database. In ascending order of number, without gaps.
const std::vector<Migration>& embeddedMigrations();
/// Those of the API keys, which are a database of their own.
const std::vector<Migration>& embeddedKeyMigrations();

enum class FileKind {
    kEmpty,    ///< an SQLite file without content
    kOurs,     ///< a database of ours with schema version 1 or more
    kForeign,  ///< an SQLite database of something else
};

/// Writes nothing. Throws Failure kDataLoss when the file is no SQLite database.
FileKind identify(SqliteConnection& connection);

/// PRAGMA user_version: the number of the last migration applied.
int schemaVersion(SqliteConnection& connection);

/// Applies missing migrations. Throws Failure:
/// - kSchemaTooNew: the database has a migration that `migrations` lacks;
/// - kDataLoss: a migration was edited after it was applied, the record has a gap, or the schema is
///   not what the migrations make.
/// Migrations before a failed one stay applied.
void migrate(SqliteConnection& connection, const std::vector<Migration>& migrations, std::int64_t nowMs);

}  // namespace shapedb::store
