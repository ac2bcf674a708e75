// SPDX-License-Identifier: GPL-3.0-or-later
// Which server should hold which shards: computed by each server from the names of those that are alive, with
// the same result.
#pragma once

#include <string>
#include <vector>

#include "server/cluster/shard.h"

namespace shapedb::cluster {

/// assignment[shard][slot]: an index into `servers`. Servers of one shard differ; there are as many slots as
/// `replicas`, or as servers if these are fewer. A server has at most its even share, rounded up, and a few
/// more where the last shards find room only on servers that have them already.
///
/// Rendezvous hashing with bounded loads: when a server comes or goes, few shards move that need not.
/// `servers`: in ascending order, without repetition; empty gives no slots. `replicas`: at least 1.
[[nodiscard]] std::vector<std::vector<int>> assignShards(const std::vector<std::string>& servers,
                                                         int replicas);

}  // namespace shapedb::cluster
