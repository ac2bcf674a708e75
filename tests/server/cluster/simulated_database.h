// SPDX-License-Identifier: GPL-3.0-or-later
// The database of a simulated cluster: leases, and one collection with its whole history.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "server/cluster/lease_table.h"
#include "server/cluster/replica.h"

namespace shapedb::cluster::sim {

using Time = std::int64_t;

/// What a shape was since a change: its version, or 0 when it was deleted.
struct Past {
    std::int64_t number = 0;
    std::int64_t version = 0;
};

/// The version of each shape, by its id; 0: it is not there.
using Versions = std::vector<std::int64_t>;

class Database : public LeaseTable, public ReplicaSource {
  public:
    /// Of a collection that never has ids above `lastId`.
    explicit Database(int replicas, std::int64_t lastId = 0);

    // Leases. The clock is `now`.
    Result<ClusterView> beat(const Beat& beat) override;
    Result<ClusterView> view() override;

    // The collection.
    Result<Changes> changes(std::int64_t collectionId, std::int64_t after, const ShardSet& shards,
                            std::size_t limit) override;
    Result<Rows> rows(std::int64_t collectionId, const ShardSet& shards, std::int64_t afterId,
                      std::size_t limit) override;

    void put(std::int64_t shapeId);
    void remove(std::int64_t shapeId);
    void switchGeneration();
    /// Forgets changes up to this one.
    void forgetChanges(std::int64_t upTo) { forgotten_ = upTo; }

    /// Whether `server` holds the shard under this epoch now.
    bool holds(const std::string& server, int shard, std::int64_t epoch) const;

    /// What is wrong with an answer made at a moment at which `upper` was the last change: it says that it
    /// knows all up to `number`, and shows these versions of the shapes of some shards. Empty: nothing.
    std::string compare(const Versions& shown, const ShardSet& shards, std::int64_t number,
                        std::int64_t upper) const;
    std::int64_t number() const { return number_; }
    /// The last change at a time.
    std::int64_t numberAt(Time time) const;
    /// The generation that served right after a change.
    std::int64_t generationAt(std::int64_t number) const;
    std::int64_t switches() const { return generation_ - 1; }

    Time now = 0;
    bool down = false;
    static constexpr std::int64_t kCollection = 1;

  private:
    struct Row {
        std::string holder;
        std::int64_t epoch = 0;
        Time expires = 0;
        std::string wantedBy;
    };
    void change(std::int64_t shapeId, std::int64_t version);
    Row* current(const SlotSeen& seen);
    store::IndexRow rowOf(std::int64_t shapeId) const;
    ClusterView viewNow() const;

    Row& rowAt(int shard, int slot) { return slots_[static_cast<std::size_t>(shard * replicas_ + slot)]; }

    int replicas_;
    std::vector<Row> slots_;             // in order of shard and slot
    std::map<std::string, Time> alive_;  // until
    Versions shapes_;
    std::vector<std::vector<Past>> history_;    // by id
    std::vector<std::int64_t> log_{0};          // by number: the shape, or 0 for a switch
    std::vector<Time> times_{0};                // by number
    std::vector<std::int64_t> generations_{1};  // by number
    std::int64_t number_ = 0;
    std::int64_t generation_ = 1;
    std::int64_t version_ = 0;
    std::int64_t forgotten_ = 0;
};

}  // namespace shapedb::cluster::sim
