// SPDX-License-Identifier: GPL-3.0-or-later
// Loads the index of searches from a database whose own indices are damaged.
#include <algorithm>

#include "server/store/sql/rows.h"
#include "server/store/sqlite/damage.h"
#include "server/store/sqlite/sqlite_store_impl.h"

namespace shapedb::store {

namespace {

// Slow, and right while the tables can be read: what a damaged index holds is in its table, too.
constexpr char kRowsWithoutIndices[] =
    "SELECT g.rowid FROM signature g NOT INDEXED CROSS JOIN shape s NOT INDEXED ON s.id = g.shape_id WHERE "
    "s.collection_id = ?1 AND g.shape_id > ?2 AND g.generation = ?3 ORDER BY g.shape_id LIMIT ?4";
constexpr char kIndexRow[] =
    "SELECT g.shape_id, m.name, m.value, g.points_version, g.generation, g.digest, g.bytes, g.views, s.key "
    "FROM "
    "signature g NOT INDEXED CROSS JOIN shape s NOT INDEXED ON s.id = g.shape_id LEFT JOIN shape_metadata m "
    "ON m.shape_id = g.shape_id WHERE g.rowid = ?1";

std::vector<IndexRow> indexRowsWithoutIndices(Connection& connection, const Collection& collection,
                                              std::int64_t afterId, std::size_t limit) {
    std::vector<std::int64_t> places;
    {
        Query query(connection, kRowsWithoutIndices, collection.id, afterId, collection.generation, limit);
        while (query.step()) places.push_back(query.integer(0));
    }
    std::vector<IndexRow> rows;
    for (const std::int64_t place : places) {
        Query query(connection, kIndexRow, place);
        readIndexRows(connection, query, rows, rows.size() + 1);
    }
    return rows;
}

}  // namespace

Result<std::vector<IndexRow>> SqliteStore::loadIndex(std::int64_t collectionId, std::int64_t afterId,
                                                     std::size_t limit) {
    auto whole = SqlStore::loadIndex(collectionId, afterId, limit);
    if (whole || whole.error().code != ErrorCode::kDataLoss) return whole;
    auto rows = read("load the index", [&](Connection& connection) {
        return indexRowsWithoutIndices(connection, requireCollection(connection, collectionId), afterId,
                                       limit);
    });
    if (rows) noteDamagedIndex(whole.error().message);
    return rows;
}

void SqliteStore::noteDamagedIndex(const std::string& damage) {
    damaged_ = true;
    const std::string line =
        "an index of the database is damaged; searches are answered from the tables alone; to mend it, make "
        "a "
        "backup now, which is then copied from the tables, and restore it (" +
        damage + ")";
    const std::lock_guard<std::mutex> lock(findingsMutex_);
    if (std::find(findings_.begin(), findings_.end(), line) == findings_.end()) findings_.push_back(line);
}

}  // namespace shapedb::store
