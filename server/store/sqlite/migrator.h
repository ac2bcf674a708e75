// Brings a database file to the schema of this program.
//
// Migrations are the numbered files of migrations/, compiled in. They only go forward, each
// in its own transaction, and are never edited once released: the database remembers the
// SHA-256 of every text it has seen.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "server/store/sqlite/connection.h"

namespace shapedb::store {

/// PRAGMA application_id of every database of ours: "ShDB". Persisted.
constexpr std::int64_t kApplicationId = 0x53684442;
/// PRAGMA page_size. Persisted; restore copies pages, so all our files must agree.
constexpr std::int64_t kPageSize = 4096;

struct Migration {
    int number;        ///< 1, 2, 3, ...
    const char* name;  ///< file name without its ending
    const char* sql;
};

/// migrations/*.sql by rising number, without a gap.
const std::vector<Migration>& embeddedMigrations();

enum class FileKind {
    kEmpty,    ///< an SQLite file without content
    kOurs,     ///< a database of ours with schema version 1 or more
    kForeign,  ///< an SQLite database of something else
};

/// Reads only. Throws Failure kDataLoss when it is no SQLite database at all.
FileKind identify(Connection& connection);

/// PRAGMA user_version: the number of the last migration applied.
int schemaVersion(Connection& connection);

/// Applies what is missing. Throws Failure:
/// - kSchemaTooNew: the file has a migration that `migrations` does not;
/// - kDataLoss: a migration was edited after it had been applied, the record has a gap, or
///   the tables are not those the applied migrations make.
/// Everything up to the failed migration stays applied.
void migrate(Connection& connection, const std::vector<Migration>& migrations, std::int64_t nowMs);

}  // namespace shapedb::store
