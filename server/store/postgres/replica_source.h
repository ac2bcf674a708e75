// SPDX-License-Identifier: GPL-3.0-or-later
// What copies of shards in memory are made of and follow: the log of changes, and the rows of the index with
// their shard.
#pragma once

#include "server/cluster/replica.h"
#include "server/store/postgres/pool.h"

namespace shapedb::store {

/// Thread-safe. Beyond ReplicaSource: changes are `forgotten`, too, if one of them is of the collection as a
/// whole, or `after` is beyond the last one.
class PostgresReplicaSource final : public cluster::ReplicaSource {
  public:
    /// The pool, not owned, must outlive this.
    explicit PostgresReplicaSource(PostgresPool& pool) : pool_(pool) {}

    [[nodiscard]] Result<cluster::Changes> changes(std::int64_t collectionId, std::int64_t after,
                                                   const cluster::ShardSet& shards,
                                                   std::size_t limit) override;
    /// `limit` 0: only the position.
    [[nodiscard]] Result<cluster::Rows> rows(std::int64_t collectionId, const cluster::ShardSet& shards,
                                             std::int64_t afterId, std::size_t limit) override;

  private:
    PostgresPool& pool_;
};

}  // namespace shapedb::store
