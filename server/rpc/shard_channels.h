// SPDX-License-Identifier: GPL-3.0-or-later
// Requests to the other servers of a cluster, over gRPC.
#pragma once

#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "server/cluster/shard_query.h"
#include "server/rpc/shard_service.h"

namespace shapedb::rpc {

/// The name of a server in the lease table: where it is asked, and which start of it this is.
[[nodiscard]] std::string memberName(const std::string& address, const std::string& start);
/// Where a server of that name is asked.
[[nodiscard]] std::string addressOf(const std::string& memberName);

/// Keeps a channel to each server that was asked. Thread-safe.
class ShardChannels final : public cluster::ShardTransport {
  public:
    explicit ShardChannels(ClusterTls tls);
    ~ShardChannels() override;

    [[nodiscard]] std::unique_ptr<Request> find(const std::string& server,
                                                const cluster::FindRequest& request,
                                                RunContext::Clock::time_point until,
                                                Done<cluster::FindAnswer> done) override;
    [[nodiscard]] std::unique_ptr<Request> fit(const std::string& server, const cluster::FitRequest& request,
                                               RunContext::Clock::time_point until,
                                               Done<cluster::FitAnswer> done) override;

  private:
    struct Peer;
    std::shared_ptr<Peer> peer(const std::string& server);

    const ClusterTls tls_;
    std::mutex mutex_;
    std::map<std::string, std::shared_ptr<Peer>> peers_;  ///< by address
};

}  // namespace shapedb::rpc
