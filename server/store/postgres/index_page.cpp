// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/store/postgres/index_page.h"

#include <limits>
#include <string>

#include "server/store/postgres/statement.h"
#include "server/store/sql/rows.h"
#include "server/store/sql/sql.h"

namespace shapedb::store {

namespace {

#define SHAPEDB_OF_SHARDS(shards) " AND shard = ANY(string_to_array(" shards ", ',')::smallint[])"

// Where a page ends: by ids alone.
#define SHAPEDB_PAGE_END(shards)                                                     \
    "WITH page AS (SELECT id FROM shape WHERE collection_id = ?1 AND id > ?2" shards \
    " ORDER BY id LIMIT "                                                            \
    "?3) SELECT max(id), count(*) FROM page"
// That all tables begin and end with the page is said of each: PostgreSQL would read the others as a whole
// where it merges them.
#define SHAPEDB_PAGE(shards)                                                                             \
    "COPY (SELECT " SHAPEDB_INDEX_COLUMNS                                                                \
    " FROM shape s JOIN signature g ON g.shape_id = s.id AND g.generation = ?4 AND g.shape_id > ?2 AND " \
    "g.shape_id <= ?3 LEFT JOIN shape_metadata m ON m.shape_id = s.id AND m.shape_id > ?2 AND "          \
    "m.shape_id <= ?3 WHERE s.collection_id = ?1 AND s.id > ?2 AND s.id <= ?3" shards                    \
    " ORDER BY s.id) TO "                                                                                \
    "STDOUT (FORMAT binary)"

constexpr char kEndOfAll[] = SHAPEDB_PAGE_END("");
constexpr char kPageOfAll[] = SHAPEDB_PAGE("");
constexpr char kEndOfShards[] = SHAPEDB_PAGE_END(SHAPEDB_OF_SHARDS("?4"));
constexpr char kPageOfShards[] = SHAPEDB_PAGE(SHAPEDB_OF_SHARDS("?5"));

std::string listOf(const cluster::ShardSet& shards) {
    std::vector<int> numbers;
    for (int shard = 0; shard < cluster::kShards; ++shard) {
        if (shards[static_cast<std::size_t>(shard)]) numbers.push_back(shard);
    }
    return listed(numbers);
}

/// The last id of the page, and the number of its shapes.
void findEnd(Query end, IndexPage& page, std::size_t limit) {
    end.step();
    page.last = static_cast<std::size_t>(end.integer(1)) < limit;
    page.upTo = page.last ? std::numeric_limits<std::int64_t>::max() : end.integer(0);
}

}  // namespace

IndexPage readIndexPage(Connection& connection, std::int64_t collectionId, std::int64_t generation,
                        const cluster::ShardSet& shards, std::int64_t afterId, std::size_t limit) {
    IndexPage page;
    const auto read = [&](Query query) { readIndexRows(connection, query, page.rows); };
    if (shards.all()) {
        findEnd({connection, kEndOfAll, collectionId, afterId, limit}, page, limit);
        read({connection, kPageOfAll, collectionId, afterId, page.upTo, generation});
    } else {
        const std::string list = listOf(shards);
        findEnd({connection, kEndOfShards, collectionId, afterId, limit, list}, page, limit);
        read({connection, kPageOfShards, collectionId, afterId, page.upTo, generation, list});
    }
    return page;
}

}  // namespace shapedb::store
