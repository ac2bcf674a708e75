// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/store/postgres/replica_source.h"

#include <algorithm>
#include <optional>
#include <set>
#include <utility>

#include "server/store/postgres/index_page.h"
#include "server/store/postgres/statement.h"
#include "server/store/postgres/transactions.h"
#include "server/store/sql/rows.h"

namespace shapedb::store {

namespace {

constexpr char kLastChange[] = "SELECT last_change FROM collection WHERE id = ?1";
constexpr char kNextChanges[] =
    "SELECT number, shape_id FROM change WHERE collection_id = ?1 AND number > ?2 AND number <= ?3 ORDER BY "
    "number";
// Columns as those of kLoadIndex.
constexpr char kRowsOfShapes[] =
    "SELECT " SHAPEDB_INDEX_COLUMNS
    " FROM shape s JOIN signature g ON g.shape_id = s.id AND g.generation = ?3 LEFT JOIN shape_metadata m ON "
    "m.shape_id = s.id WHERE s.collection_id = ?1 AND s.id = ANY(string_to_array(?2, ',')::bigint[]) ORDER "
    "BY s.id";

bool contains(const cluster::ShardSet& shards, int shard) { return shards[static_cast<std::size_t>(shard)]; }

/// Throws Failure kNotFound.
cluster::Position positionOf(Connection& connection, std::int64_t collectionId) {
    const Collection collection = requireCollection(connection, collectionId);
    return {numberOf(Query(connection, kLastChange, collectionId)), collection.generation};
}

/// The shapes of the changes in (after, upTo] that are in the shards; nothing if not all of them are kept, or
/// one is not of a shape.
std::optional<std::set<std::int64_t>> changedShapes(Connection& connection, std::int64_t collectionId,
                                                    std::int64_t after, std::int64_t upTo,
                                                    const cluster::ShardSet& shards) {
    std::set<std::int64_t> ids;
    std::int64_t last = after;
    Query entries(connection, kNextChanges, collectionId, after, upTo);
    while (entries.step()) {
        if (entries.integer(0) != ++last || entries.isNull(1)) return std::nullopt;
        const std::int64_t id = entries.integer(1);
        if (contains(shards, cluster::shardOf(id))) ids.insert(id);
    }
    if (last != upTo) return std::nullopt;
    return ids;
}

cluster::Changes readChanges(Connection& connection, std::int64_t collectionId, std::int64_t after,
                             const cluster::ShardSet& shards, std::size_t limit) {
    cluster::Changes changes;
    changes.at = positionOf(connection, collectionId);
    changes.forgotten = after > changes.at.number;
    if (changes.forgotten) return changes;
    const auto missed = static_cast<std::uint64_t>(changes.at.number - after);
    const std::int64_t upTo = after + static_cast<std::int64_t>(std::min<std::uint64_t>(missed, limit));
    const auto ids = changedShapes(connection, collectionId, after, upTo, shards);
    changes.forgotten = !ids;
    if (changes.forgotten) return changes;
    changes.upTo = upTo;
    changes.changed.assign(ids->begin(), ids->end());
    if (ids->empty()) return changes;
    Query query(connection, kRowsOfShapes, collectionId, listed(*ids), changes.at.generation);
    readIndexRows(connection, query, changes.rows);
    return changes;
}

cluster::Rows readRows(Connection& connection, std::int64_t collectionId, const cluster::ShardSet& shards,
                       std::int64_t afterId, std::size_t limit) {
    cluster::Rows rows;
    rows.at = positionOf(connection, collectionId);
    rows.last = shards.none();
    if (limit == 0 || rows.last) return rows;
    IndexPage page = readIndexPage(connection, collectionId, rows.at.generation, shards, afterId, limit);
    rows.rows = std::move(page.rows);
    rows.upTo = page.upTo;
    rows.last = page.last;
    return rows;
}

}  // namespace

Result<cluster::Changes> PostgresReplicaSource::changes(std::int64_t collectionId, std::int64_t after,
                                                        const cluster::ShardSet& shards, std::size_t limit) {
    return guarded("read the changes of shards", [&] {
        cluster::Changes changes;
        inReadTransaction(pool_, [&](Connection& connection) {
            changes = readChanges(connection, collectionId, after, shards, limit);
        });
        return changes;
    });
}

Result<cluster::Rows> PostgresReplicaSource::rows(std::int64_t collectionId, const cluster::ShardSet& shards,
                                                  std::int64_t afterId, std::size_t limit) {
    return guarded("read the rows of shards", [&] {
        cluster::Rows rows;
        inReadTransaction(pool_, [&](Connection& connection) {
            rows = readRows(connection, collectionId, shards, afterId, limit);
        });
        return rows;
    });
}

}  // namespace shapedb::store
