// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/store/sql/migration.h"

#include <string_view>

#include "common/sha256.h"

namespace shapedb::store {

namespace {

constexpr char kReadRecord[] = "SELECT number, name, sha256 FROM schema_migration ORDER BY number";
constexpr char kWriteRecord[] = "INSERT INTO schema_migration VALUES (?1, ?2, ?3, ?4)";

std::string fingerprint(const Migration& migration) {
    const std::string_view text(migration.sql);
    return toHex(sha256(text.data(), text.size()));
}

}  // namespace

std::size_t verifyMigrations(Connection& connection, const std::vector<Migration>& migrations) {
    std::size_t applied = 0;
    Query record(connection, kReadRecord);
    while (record.step()) {
        const std::int64_t number = record.integer(0);
        const std::string name = record.text(1);
        if (applied == migrations.size()) {
            raise(ErrorCode::kSchemaTooNew, "the database has migration " + std::to_string(number) + " (" +
                                                name + "), this program knows " +
                                                std::to_string(migrations.size()) +
                                                "; use the newer program");
        }
        const Migration& known = migrations[applied];
        if (number != known.number) {
            raise(ErrorCode::kDataLoss, "the record of applied migrations is damaged: expected number " +
                                            std::to_string(known.number) + ", found " +
                                            std::to_string(number));
        }
        if (record.text(2) != fingerprint(known)) {
            raise(ErrorCode::kDataLoss,
                  "migration " + std::to_string(number) + " (" + name +
                      ") was applied with another text than this program has; migrations "
                      "are never edited, use the program that wrote the database");
        }
        ++applied;
    }
    return applied;
}

void recordMigration(Connection& connection, const Migration& migration, std::int64_t nowMs) {
    Query(connection, kWriteRecord, migration.number, std::string(migration.name), fingerprint(migration),
          nowMs)
        .run();
}

}  // namespace shapedb::store
