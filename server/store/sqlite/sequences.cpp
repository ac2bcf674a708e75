// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/store/sqlite/sequences.h"

#include <algorithm>

#include "server/store/sqlite/sqlite_sql.h"

namespace shapedb::store {

namespace {

std::int64_t storedLastId(SqliteConnection& connection, const std::string& table) {
    Query query(connection, "SELECT seq FROM sqlite_sequence WHERE name = ?1", table);
    return query.step() ? query.integer(0) : 0;
}

std::int64_t largestId(SqliteConnection& connection, const std::string& table) {
    return connection.integer("SELECT coalesce(max(id), 0) FROM " + table);
}

}  // namespace

std::int64_t lastId(SqliteConnection& connection, const std::string& table) {
    const std::int64_t stored = storedLastId(connection, table);
    return stored >= 0 && stored <= kMostCounted ? stored : largestId(connection, table);
}

void setLastId(SqliteConnection& connection, const std::string& table, std::int64_t id) {
    connection.execute("DELETE FROM sqlite_sequence WHERE name = '" + table +
                       "'; INSERT INTO sqlite_sequence (name, seq) VALUES ('" + table + "', " +
                       std::to_string(id) + ")");
}

void renumber(SqliteConnection& connection, const std::string& table, std::int64_t last) {
    connection.execute("UPDATE " + table + " SET id = " + std::to_string(last) +
                       " + n.place FROM (SELECT id AS old, row_number() OVER (ORDER BY id) AS place FROM " +
                       table + ") n WHERE n.old = " + table + ".id");
    setLastId(connection, table, std::max(last, largestId(connection, table)));
}

std::vector<std::string> mendSequences(SqliteConnection& connection) {
    std::vector<std::string> mended;
    for (const std::string table : {"collection", "shape", "job", "rebuild"}) {
        const std::int64_t stored = storedLastId(connection, table);
        const std::int64_t last = lastId(connection, table);
        if (stored == last) continue;
        Transaction transaction(connection, Transaction::Kind::kWrite);
        setLastId(connection, table, last);
        transaction.commit();
        mended.push_back("the id sequence of table " + table + " stood at " + std::to_string(stored) +
                         ", beyond all ids: it was set back to " + std::to_string(last));
    }
    return mended;
}

namespace {

std::int64_t commitsOf(Query&& tally) {
    if (!tally.step()) raise(ErrorCode::kDataLoss, "the row of table tally is missing");
    return tally.integer(0);
}

}  // namespace

std::int64_t countCommits(SqliteConnection& connection) {
    return commitsOf(Query(connection, sqlite_sql::kCommits));
}

std::int64_t addCommit(SqliteConnection& connection) {
    return commitsOf(Query(connection, sqlite_sql::kCountCommit));
}

}  // namespace shapedb::store
