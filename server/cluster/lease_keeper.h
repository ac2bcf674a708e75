// SPDX-License-Identifier: GPL-3.0-or-later
// The leases of one server: what it asks of the table, and for which shards it may answer at a moment.
//
// Without threads, clock or database: the caller sends `next` to a LeaseTable about three times in the length
// of a lease, and reports the result. That is how a simulation runs it.
//
// What holds: the keeper never says that the server may answer for a shard under an epoch that the table has
// given away or let end. For that it counts a lease from before the beat that renewed it was sent, and lets a
// lease that it hands over go before it asks to. Clocks of servers may differ in what they show, not in
// speed.
#pragma once

#include <array>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <vector>

#include "server/cluster/lease_table.h"
#include "server/cluster/shard.h"

namespace shapedb::cluster {

struct KeeperOptions {
    std::string server;                      ///< unique in the cluster, and for each start of a process
    int replicas = 1;                        ///< of each shard; at least 1
    std::chrono::milliseconds term{10'000};  ///< length of a lease
};

/// Not thread-safe.
class LeaseKeeper {
  public:
    explicit LeaseKeeper(KeeperOptions options) : options_(std::move(options)) {}

    /// What to ask of the table now. Leases that it hands over are given up by this call.
    [[nodiscard]] Beat next(Instant now);
    /// The table after a beat that was sent at `sentAt`, or as it was read then. After an error nothing need
    /// be told.
    void onView(Instant sentAt, const ClusterView& view);

    /// Shards of which the content is there and follows the changes; only these are taken and renewed.
    void setLoaded(const ShardSet& loaded) { loaded_ = loaded; }
    /// From now on the server hands over what it has to others that want it.
    void leave() { leaving_ = true; }

    /// The epoch under which the server may answer for this shard; nothing: it may not.
    [[nodiscard]] std::optional<std::int64_t> epoch(int shard, Instant now) const;
    /// Whether it may have got this lease since the last view: who asks has seen the table later.
    [[nodiscard]] bool isNews(int shard, std::int64_t epoch) const;
    /// The shards that it may answer for.
    [[nodiscard]] ShardSet held(Instant now) const;
    /// The shards to load and to keep: those held, and those that it should hold.
    [[nodiscard]] ShardSet wanted(Instant now) const;

  private:
    struct Own {
        int slot = 0;
        std::int64_t epoch = 0;
        Instant until{0};
    };
    using Slot = std::tuple<int, int, std::int64_t>;  // shard, slot, epoch

    void ask(const Lease& lease, Instant now, Beat& beat);
    bool aliveElsewhere(const std::string& server) const;

    KeeperOptions options_;
    ShardSet loaded_;
    ShardSet target_;                           ///< what it should hold, by the last view
    ClusterView view_;                          ///< the last
    std::vector<std::vector<int>> assignment_;  ///< of its servers
    std::array<std::optional<Own>, kShards> own_;
    std::set<Slot> givenUp_;  ///< asked to be handed over: not used again, whatever a view says
    bool leaving_ = false;
};

}  // namespace shapedb::cluster
