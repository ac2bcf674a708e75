// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/cluster_member.h"

#include <chrono>
#include <thread>
#include <utility>

#include "core/base/return_if_error.h"
#include "server/config/settings.h"
#include "server/security/key.h"
#include "server/store/postgres/postgres_store.h"

namespace shapedb {

namespace {

/// How long a start waits for shards that have no server; then calls are answered, and health tells.
constexpr std::chrono::seconds kPatience{5};
constexpr std::chrono::milliseconds kPause{20};

/// How other servers reach this one, which listens on `port`.
Result<std::string> advertised(const config::ServerConfig::Cluster& config, int port) {
    const std::string& wanted = config.advertise.empty() ? config.listen : config.advertise;
    auto endpoint = config::parseEndpoint(wanted);
    if (!endpoint) endpoint = config::parseEndpoint(wanted + ":0");
    RETURN_IF_ERROR(endpoint);
    if (config.advertise.empty() || endpoint->port == 0) endpoint->port = port;
    return endpoint->text();
}

cluster::KeeperOptions keeperOptions(const config::ServerConfig& config, const std::string& name) {
    return {name, config.cluster.replicas, std::chrono::milliseconds(config.cluster.leaseMilliseconds)};
}

}  // namespace

bool isMember(const config::ServerConfig& config) {
    return config.cluster.replicas > 0 && config.role != "worker";
}

Result<std::unique_ptr<ClusterEntrance>> openEntrance(const config::ServerConfig& config,
                                                      store::Store& store) {
    auto entrance = std::make_unique<ClusterEntrance>();
    auto tls = rpc::readClusterTls(config.cluster);
    RETURN_IF_ERROR(tls);
    entrance->tls = std::move(*tls);
    const auto port = entrance->server.listen(config.cluster.listen, entrance->tls);
    RETURN_IF_ERROR(port);
    const auto address = advertised(config.cluster, *port);
    RETURN_IF_ERROR(address);
    const auto start = security::makeSecret();
    RETURN_IF_ERROR(start);
    entrance->name = rpc::memberName(*address, start->substr(0, 8));
    entrance->leases = store::leaseTable(store, config.cluster.replicas);
    entrance->source = store::replicaSource(store);
    if (entrance->leases && entrance->source) return entrance;
    return fail(ErrorCode::kInvalidArgument,
                "cluster.replicas needs a shared database (store.engine = postgres)");
}

ClusterMember::ClusterMember(std::unique_ptr<ClusterEntrance> entrance, const config::ServerConfig& config,
                             catalog::Catalog& catalog, catalog::SearchRunner& runner,
                             telemetry::LoggerPtr log)
    : entrance_(std::move(entrance)),
      channels_(entrance_->tls),
      member_(
          {std::move(entrance_->leases), std::move(entrance_->source),
           [&catalog] { return catalog.collectionIds(); },
           [&catalog](const std::vector<std::int64_t>& ids) { catalog.forgetSurfaces(ids); }, std::move(log)},
          keeperOptions(config, entrance_->name)),
      holder_({member_, [&catalog](std::int64_t id) { return catalog.surface(id); },
               [&runner](bool background, const std::function<Result<void>()>& work) {
                   return background ? runner.inBackground(work) : runner.inForeground(work);
               }}) {
    catalog.setTotals([this] {
        const auto now = member_.state();
        return index::CollectionIndex::Totals{now.signatures, now.bytes};
    });
}

Result<void> ClusterMember::start() {
    RETURN_IF_ERROR(member_.start());
    entrance_->server.serve(holder_);
    const auto until = std::chrono::steady_clock::now() + kPatience;
    while (!canSearch() && std::chrono::steady_clock::now() < until) std::this_thread::sleep_for(kPause);
    return {};
}

void ClusterMember::stop() {
    entrance_->server.shutDown();
    member_.stop();
}

}  // namespace shapedb
