// SPDX-License-Identifier: GPL-3.0-or-later
// Decides whether a server may answer a request now.
#pragma once

#include <cstdint>

#include "server/cluster/gather.h"
#include "server/cluster/lease_keeper.h"
#include "server/cluster/shard.h"

namespace shapedb::cluster {

/// What a search of this server would read. Immutable during the search.
struct Content {
    ShardSet complete;            ///< shards that are there as a whole
    std::int64_t number = 0;      ///< the last change that it knows of all of them
    std::int64_t generation = 0;  ///< of its signatures
};

enum class Answerable {
    kYes,
    kBehind,  ///< it will be, once the content has followed the changes: worth waiting a little
    kNo,      ///< some shard is not there, or not held under the epoch that is asked for
};

/// Ask it after the content to be read was taken: a content that is taken while the leases hold knows all
/// that the length of a lease promises.
[[nodiscard]] Answerable answerable(const Ask& ask, const Content& content, const LeaseKeeper& keeper,
                                    Instant now);

}  // namespace shapedb::cluster
