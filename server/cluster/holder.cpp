// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/cluster/holder.h"

namespace shapedb::cluster {

Answerable answerable(const Ask& ask, const Content& content, const LeaseKeeper& keeper, Instant now) {
    for (const auto& [shard, epoch] : ask.shards) {
        if (!content.complete[static_cast<std::size_t>(shard)]) return Answerable::kNo;
        if (keeper.epoch(shard, now) != epoch) return Answerable::kNo;
    }
    const bool follows = content.number >= ask.atLeast && content.generation >= ask.leastGeneration;
    return follows ? Answerable::kYes : Answerable::kBehind;
}

}  // namespace shapedb::cluster
