// SPDX-License-Identifier: GPL-3.0-or-later
// The address at which the servers of a cluster ask this one about its shards. It has nothing for clients:
// who may connect there may read every collection.
#pragma once

#include <memory>
#include <string>

#include "core/base/error.h"
#include "server/cluster/shard_holder.h"
#include "server/config/server_config.h"

namespace shapedb::rpc {

/// PEM texts; all empty: no TLS. Both sides of a connection show a certificate that the authorities signed.
struct ClusterTls {
    std::string certificate;
    std::string key;
    std::string authorities;
};
/// Errors: kFileNotReadable.
[[nodiscard]] Result<ClusterTls> readClusterTls(const config::ServerConfig::Cluster& config);

/// Not thread-safe: one thread starts it and takes it down.
class ShardServer {
  public:
    ShardServer();
    ~ShardServer();

    /// Listens at `endpoint` ("HOST:PORT", port 0: any) and returns the port. Answers kUnavailable until
    /// `serve`. Errors: kUnavailable (cannot listen there).
    [[nodiscard]] Result<int> listen(const std::string& endpoint, const ClusterTls& tls);
    /// `holder` must outlive `shutDown`.
    void serve(const cluster::ShardHolder& holder);
    /// Cancels the calls still running and waits for them. Idempotent.
    void shutDown();

  private:
    struct Parts;
    std::unique_ptr<Parts> parts_;
};

}  // namespace shapedb::rpc
