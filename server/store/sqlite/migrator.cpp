// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/store/sqlite/migrator.h"

#include <map>

#include "server/store/failpoints.h"

namespace shapedb::store {

namespace {

constexpr char kCreateRecord[] =
    "CREATE TABLE IF NOT EXISTS schema_migration ("
    "number INTEGER PRIMARY KEY, name TEXT NOT NULL, sha256 TEXT NOT NULL, applied_at INTEGER NOT NULL) "
    "STRICT";
constexpr char kReadSchema[] = "SELECT type || ' ' || name, coalesce(sql, '') FROM sqlite_schema";

void apply(SqliteConnection& connection, const Migration& migration, std::int64_t nowMs) {
    Transaction transaction(connection, Transaction::Kind::kWrite);
    if (migration.number == 1) {
        connection.execute("PRAGMA application_id=" + std::to_string(kApplicationId));
        connection.execute(kCreateRecord);
    }
    SHAPEDB_FAILPOINT("migration.begun");
    connection.execute(migration.sql);
    SHAPEDB_FAILPOINT("migration.applied");
    recordMigration(connection, migration, nowMs);
    // Part of the transaction, like the rest.
    connection.execute("PRAGMA user_version=" + std::to_string(migration.number));
    SHAPEDB_FAILPOINT("migration.recorded");
    transaction.commit();
    SHAPEDB_FAILPOINT("migration.committed");
}

std::map<std::string, std::string> schemaOf(SqliteConnection& connection) {
    std::map<std::string, std::string> schema;
    Query rows(connection, kReadSchema);
    while (rows.step()) {
        std::string name = rows.text(0);
        // Not SQLite's own: sqlite_sequence, automatic indices, statistics.
        if (name.find(" sqlite_") == std::string::npos) schema.emplace(std::move(name), rows.text(1));
    }
    return schema;
}

/// A file with our marks may still have other tables, or triggers of its own: refuse it before the store uses
/// it.
void verifySchema(SqliteConnection& connection, const std::vector<Migration>& migrations) {
    SqliteConnection reference(":memory:", OpenMode::kReadWriteCreate, 0);
    for (const Migration& migration : migrations) apply(reference, migration, 0);
    const auto expected = schemaOf(reference);
    const auto actual = schemaOf(connection);
    for (const auto& [name, sql] : expected) {
        const auto found = actual.find(name);
        if (found == actual.end()) raise(ErrorCode::kDataLoss, "the database lacks the " + name);
        if (found->second != sql) raise(ErrorCode::kDataLoss, "the database has a different " + name);
    }
    for (const auto& entry : actual) {
        if (expected.count(entry.first) == 0) {
            raise(ErrorCode::kDataLoss,
                  "the database has a " + entry.first + " that ShapeDB did not create; drop it");
        }
    }
}

}  // namespace

FileKind identify(SqliteConnection& connection) {
    const std::int64_t id = connection.integer("PRAGMA application_id");
    const std::int64_t version = connection.integer("PRAGMA user_version");
    const std::int64_t objects = connection.integer("SELECT count(*) FROM sqlite_schema");
    if (id == 0 && version == 0 && objects == 0) return FileKind::kEmpty;
    return id == kApplicationId && version > 0 ? FileKind::kOurs : FileKind::kForeign;
}

int schemaVersion(SqliteConnection& connection) {
    return static_cast<int>(connection.integer("PRAGMA user_version"));
}

void migrate(SqliteConnection& connection, const std::vector<Migration>& migrations, std::int64_t nowMs) {
    const int version = schemaVersion(connection);
    if (version < 0 || static_cast<std::size_t>(version) > migrations.size()) {
        raise(ErrorCode::kSchemaTooNew, "the database has schema version " + std::to_string(version) +
                                            ", this program knows " + std::to_string(migrations.size()) +
                                            "; use the newer program");
    }
    const std::size_t applied = version == 0 ? 0 : verifyMigrations(connection, migrations);
    if (applied != static_cast<std::size_t>(version)) {
        raise(ErrorCode::kDataLoss, "the database claims to have schema version " + std::to_string(version) +
                                        " but records " + std::to_string(applied) + " migrations");
    }
    for (std::size_t i = applied; i < migrations.size(); ++i) apply(connection, migrations[i], nowMs);
    verifySchema(connection, migrations);
}

}  // namespace shapedb::store
