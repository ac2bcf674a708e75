// SPDX-License-Identifier: GPL-3.0-or-later
// The leases of shards in the database: tables cluster_server and cluster_slot.
#pragma once

#include "server/cluster/lease_table.h"
#include "server/store/postgres/pool.h"

namespace shapedb::store {

/// Beats of all servers take place one after the other, each as of one moment by the clock of the database. A
/// server that stops in the middle of its own holds the others up for two seconds at most.
///
/// It has a connection of its own, so that no other work of the server delays a beat.
class PostgresLeaseTable final : public cluster::LeaseTable {
  public:
    /// `replicas`, at least 1, is the same on all servers. Where it has become larger, slots are added by the
    /// next beat; where smaller, those beyond are not there any more, whoever holds them.
    PostgresLeaseTable(const PostgresAddress& address, int replicas)
        : pool_(address, texts_, 1), replicas_(replicas) {}

    [[nodiscard]] Result<cluster::ClusterView> beat(const cluster::Beat& beat) override;
    [[nodiscard]] Result<cluster::ClusterView> view() override;

  private:
    const StatementTexts texts_;  ///< none: all statements are PostgreSQL's
    PostgresPool pool_;
    const int replicas_;
};

}  // namespace shapedb::store
