// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/cluster/gather.h"

namespace shapedb::cluster {

RoutesPtr routesOf(const ClusterView& view) {
    auto routes = std::make_shared<Routes>();
    std::map<std::string, std::size_t> places;
    for (const Lease& lease : view.leases) {
        if (lease.holder.empty() || lease.left.count() <= 0) continue;
        const auto [place, isNew] = places.emplace(lease.holder, routes->servers.size());
        if (isNew) routes->servers.push_back(lease.holder);
        routes->holders[static_cast<std::size_t>(lease.shard)].push_back({place->second, lease.epoch});
    }
    return routes;
}

Gather::Gather(RoutesPtr routes, std::int64_t atLeast, std::int64_t leastGeneration, std::uint64_t turn)
    : routes_(std::move(routes)), atLeast_(atLeast), turn_(turn), generation_(leastGeneration) {}

ShardSet Gather::shardsOf(const Ask& ask) {
    ShardSet shards;
    for (const auto& [shard, epoch] : ask.shards) shards.set(static_cast<std::size_t>(shard));
    return shards;
}

/// One ask for each server that is next in turn for some of the shards.
std::vector<Ask> Gather::askFor(const ShardSet& shards) {
    std::vector<Ask> asks(routes_->servers.size());
    std::vector<ShardSet*> tried;
    for (const std::string& server : routes_->servers) tried.push_back(&tried_[server]);
    for (std::size_t shard = 0; shard < shards.size(); ++shard) {
        if (!shards[shard]) continue;
        const auto& holders = routes_->holders[shard];
        const Routes::Holder* next = nullptr;
        for (std::size_t i = 0; i < holders.size() && next == nullptr; ++i) {
            const Routes::Holder& holder = holders[(turn_ + shard + i) % holders.size()];
            if (!tried[holder.server]->test(shard)) next = &holder;
        }
        stuck_.set(shard, next == nullptr);
        if (next == nullptr) continue;
        tried[next->server]->set(shard);
        asks[next->server].shards.emplace_back(static_cast<int>(shard), next->epoch);
    }
    std::vector<Ask> toSend;
    for (std::size_t server = 0; server < asks.size(); ++server) {
        Ask& ask = asks[server];
        if (ask.shards.empty()) continue;
        ask.id = ++lastId_;
        ask.server = routes_->servers[server];
        ask.atLeast = atLeast_;
        ask.leastGeneration = generation_;
        open_.emplace(ask.id, ask);
        toSend.push_back(std::move(ask));
    }
    return toSend;
}

std::vector<Ask> Gather::start() { return askFor(ShardSet().set()); }

/// Whether the answer is what was asked for: the same shards, each under the same epoch. One that covers
/// fewer cannot count for these either: its hits are the best of all of its shards together.
bool Gather::answers(const Ask& ask, const Coverage& coverage) const {
    return coverage.shards == ask.shards && coverage.number >= ask.atLeast &&
           coverage.generation >= generation_;
}

std::vector<Ask> Gather::onAnswer(std::uint64_t id, const Coverage& coverage) {
    const auto found = open_.find(id);
    if (found == open_.end()) return {};
    if (!answers(found->second, coverage)) return onFailure(id);

    ShardSet again;
    if (coverage.generation > generation_) {
        // What was accepted before is of an older generation. Its servers will have the new one soon: they
        // may be asked again.
        for (const auto& [other, ask] : accepted_) {
            again |= shardsOf(ask);
            tried_[ask.server] &= ~shardsOf(ask);
        }
        accepted_.clear();
        covered_ &= ~again;
        generation_ = coverage.generation;
    }
    covered_ |= shardsOf(found->second);
    accepted_.insert(open_.extract(found));
    return askFor(again);
}

std::vector<Ask> Gather::onFailure(std::uint64_t id) {
    const auto found = open_.find(id);
    if (found == open_.end()) return {};
    const ShardSet shards = shardsOf(found->second);
    open_.erase(found);
    return askFor(shards);
}

std::vector<Ask> Gather::onRoutes(RoutesPtr fresh) {
    if (!needsRoutes()) return {};
    routes_ = std::move(fresh);
    for (auto& [server, shards] : tried_) shards &= ~stuck_;
    return askFor(stuck_);
}

std::vector<std::uint64_t> Gather::accepted() const {
    std::vector<std::uint64_t> ids;
    for (const auto& [id, ask] : accepted_) ids.push_back(id);
    return ids;
}

}  // namespace shapedb::cluster
