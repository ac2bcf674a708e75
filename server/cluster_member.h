// SPDX-License-Identifier: GPL-3.0-or-later
// This process as a member of a cluster: what listens to the other servers, asks them, and holds its shards.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "core/base/error.h"
#include "server/catalog/catalog.h"
#include "server/catalog/search_runner.h"
#include "server/cluster/member.h"
#include "server/cluster/shard_candidates.h"
#include "server/cluster/shard_holder.h"
#include "server/config/server_config.h"
#include "server/rpc/shard_channels.h"
#include "server/rpc/shard_service.h"
#include "server/telemetry/logger.h"

namespace shapedb {

/// What is there before the parts of the daemon are.
struct ClusterEntrance {
    rpc::ShardServer server;
    rpc::ClusterTls tls;
    std::string name;  ///< of this start, in the lease table
    std::unique_ptr<cluster::LeaseTable> leases;
    std::unique_ptr<cluster::ReplicaSource> source;
};

/// Whether a server of this configuration is a member.
[[nodiscard]] bool isMember(const config::ServerConfig& config);

/// Listens to the other servers. Errors: kFileNotReadable (TLS), kUnavailable (cannot listen).
[[nodiscard]] Result<std::unique_ptr<ClusterEntrance>> openEntrance(const config::ServerConfig& config,
                                                                    store::Store& store);

/// Used by the thread of the daemon, but for what `shards` and `canSearch` give others.
class ClusterMember {
  public:
    ClusterMember(std::unique_ptr<ClusterEntrance> entrance, const config::ServerConfig& config,
                  catalog::Catalog& catalog, catalog::SearchRunner& runner, telemetry::LoggerPtr log);

    /// Once the catalog has started. Waits a little for the shards to have servers. Errors: those of the
    /// lease table.
    [[nodiscard]] Result<void> start();
    /// Hands the shards over.
    void leave() { member_.leave(); }
    void stop();

    [[nodiscard]] cluster::ShardCandidates::Parts shards() { return {member_, holder_, channels_}; }
    /// As far as this server knows, and what it knows is not older than leases get.
    [[nodiscard]] bool canSearch() const {
        const auto state = member_.state();
        return state.current && state.uncovered == 0;
    }
    [[nodiscard]] cluster::Member::State state() const { return member_.state(); }

  private:
    std::unique_ptr<ClusterEntrance> entrance_;
    rpc::ShardChannels channels_;
    cluster::Member member_;
    cluster::ShardHolder holder_;
};

}  // namespace shapedb
