// SPDX-License-Identifier: GPL-3.0-or-later
// Shapes and their signatures in pages, in order of their ids: what a server reads when it starts.
//
// A page is a range of ids, and its rows come as one binary COPY: the database reads on while this side
// decodes. Each page is a transaction of its own, so that none is long.
#pragma once

#include <cstdint>
#include <vector>

#include "server/cluster/shard.h"
#include "server/store/sql/connection.h"
#include "server/store/store.h"

namespace shapedb::store {

struct IndexPage {
    std::vector<IndexRow> rows;  ///< of shapes that have a signature of the generation
    std::int64_t upTo = 0;       ///< the last id of the page
    bool last = false;           ///< there are no more
};

/// The next `limit` (> 0) shapes of the shards with id > afterId, and their signatures of `generation`.
/// Throws Failure.
[[nodiscard]] IndexPage readIndexPage(Connection& connection, std::int64_t collectionId,
                                      std::int64_t generation, const cluster::ShardSet& shards,
                                      std::int64_t afterId, std::size_t limit);

}  // namespace shapedb::store
