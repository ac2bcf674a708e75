// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/cluster/lease_keeper.h"

#include <algorithm>

#include "server/cluster/assignment.h"

namespace shapedb::cluster {

namespace {

SlotSeen seen(const Lease& lease) { return {lease.shard, lease.slot, lease.epoch}; }

bool isFree(const Lease& lease) { return lease.holder.empty() || lease.left.count() <= 0; }

}  // namespace

bool LeaseKeeper::aliveElsewhere(const std::string& server) const {
    return server != options_.server &&
           std::binary_search(view_.servers.begin(), view_.servers.end(), server);
}

/// What to ask for about a slot of a shard that the server has loaded. At most one slot of a shard is asked
/// for: `target_` loses the shard in between (see `next`).
void LeaseKeeper::ask(const Lease& lease, Instant now, Beat& beat) {
    const auto shard = static_cast<std::size_t>(lease.shard);
    const bool mine = lease.holder == options_.server;
    if (mine && givenUp_.count({lease.shard, lease.slot, lease.epoch}) > 0) {
        beat.handOver.push_back(seen(lease));
        return;
    }
    if (mine && own_[shard] && own_[shard]->slot == lease.slot) {
        const bool stays = target_[shard] && !leaving_;
        if (!stays && aliveElsewhere(lease.wantedBy)) {
            givenUp_.insert({lease.shard, lease.slot, lease.epoch});
            own_[shard].reset();
            beat.handOver.push_back(seen(lease));
        } else if (loaded_[shard] && own_[shard]->until > now) {
            beat.renew.push_back(seen(lease));
        }
    }
}

Beat LeaseKeeper::next(Instant now) {
    Beat beat;
    beat.server = options_.server;
    beat.term = options_.term;
    beat.leaving = leaving_;
    for (const Lease& lease : view_.leases) ask(lease, now, beat);
    if (leaving_) return beat;

    ShardSet open = target_ & loaded_;  // to be asked for, one slot each
    for (std::size_t shard = 0; shard < own_.size(); ++shard) {
        if (own_[shard] && own_[shard]->until > now) open.reset(shard);
    }
    for (const Lease& lease : view_.leases) {
        const auto shard = static_cast<std::size_t>(lease.shard);
        if (open[shard] && isFree(lease)) {
            beat.take.push_back(seen(lease));
            open.reset(shard);
        }
    }
    for (const Lease& lease : view_.leases) {
        const auto shard = static_cast<std::size_t>(lease.shard);
        if (!open[shard] || lease.holder == options_.server) continue;
        const auto& should = assignment_[shard];
        const bool staysThere = std::any_of(should.begin(), should.end(), [&](int server) {
            return view_.servers[static_cast<std::size_t>(server)] == lease.holder;
        });
        if (staysThere) continue;
        beat.want.push_back(seen(lease));
        open.reset(shard);
    }
    return beat;
}

void LeaseKeeper::onView(Instant sentAt, const ClusterView& view) {
    if (view.servers != view_.servers) assignment_ = assignShards(view.servers, options_.replicas);
    view_ = view;
    own_.fill(std::nullopt);
    std::set<Slot> stillOurs;
    for (const Lease& lease : view_.leases) {
        if (lease.holder != options_.server) continue;
        const Slot slot{lease.shard, lease.slot, lease.epoch};
        if (givenUp_.count(slot) > 0) {
            stillOurs.insert(slot);
        } else if (lease.left.count() > 0) {
            own_[static_cast<std::size_t>(lease.shard)] = {lease.slot, lease.epoch, sentAt + lease.left};
        }
    }
    givenUp_ = std::move(stillOurs);  // epochs only rise: a slot that is another's will not come back

    target_.reset();
    for (std::size_t shard = 0; shard < assignment_.size(); ++shard) {
        for (const int server : assignment_[shard]) {
            if (view_.servers[static_cast<std::size_t>(server)] == options_.server) target_.set(shard);
        }
    }
}

std::optional<std::int64_t> LeaseKeeper::epoch(int shard, Instant now) const {
    const auto& own = own_[static_cast<std::size_t>(shard)];
    if (!own || own->until <= now || !loaded_[static_cast<std::size_t>(shard)]) return std::nullopt;
    return own->epoch;
}

bool LeaseKeeper::isNews(int shard, std::int64_t epoch) const {
    bool isLater = false;
    for (const Lease& lease : view_.leases) {
        if (lease.shard != shard) continue;
        if (lease.epoch == epoch) return false;
        isLater |= lease.epoch < epoch;
    }
    return isLater;
}

ShardSet LeaseKeeper::held(Instant now) const {
    ShardSet shards;
    for (int shard = 0; shard < kShards; ++shard) {
        if (epoch(shard, now)) shards.set(static_cast<std::size_t>(shard));
    }
    return shards;
}

ShardSet LeaseKeeper::wanted(Instant now) const {
    ShardSet shards = leaving_ ? ShardSet() : target_;
    for (std::size_t shard = 0; shard < own_.size(); ++shard) {
        if (own_[shard] && own_[shard]->until > now) shards.set(shard);
    }
    return shards;
}

}  // namespace shapedb::cluster
