// SPDX-License-Identifier: GPL-3.0-or-later
// Scatter and gather: which server is asked for which shards of one request, and when its answers together
// are the answer of the whole.
//
// Without threads, clock or network: the caller sends what it asks for, and reports what came back. That is
// how a simulation runs it.
//
// What holds when it is `complete`: each of the 256 shards is in exactly one of the `accepted` answers; each
// of these came from who held its shards under the epoch that the routes named; none knows less than the
// change `atLeast`; and all are of one generation of signatures.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "server/cluster/lease_table.h"
#include "server/cluster/shard.h"

namespace shapedb::cluster {

/// Who may be asked for each shard, as a view of the lease table tells.
struct Routes {
    struct Holder {
        std::size_t server = 0;  ///< an index into `servers`
        std::int64_t epoch = 0;
    };
    std::vector<std::string> servers;
    /// Of a shard's leases that have not ended, in order of their slots.
    std::array<std::vector<Holder>, kShards> holders;
};
using RoutesPtr = std::shared_ptr<const Routes>;
[[nodiscard]] RoutesPtr routesOf(const ClusterView& view);

/// What is asked of one server.
struct Ask {
    std::uint64_t id = 0;  ///< of this ask within its Gather
    std::string server;
    std::vector<std::pair<int, std::int64_t>> shards;  ///< in order, with the epoch of each
    std::int64_t atLeast = 0;          ///< the last change of the collection that the answer must know
    std::int64_t leastGeneration = 0;  ///< of the signatures that it must be of
};

/// What an answer says of itself. Of what it found the gather knows nothing.
struct Coverage {
    std::vector<std::pair<int, std::int64_t>> shards;  ///< in order, with the epoch under which each is held
    std::int64_t number = 0;                           ///< the last change of the collection that it knows
    std::int64_t generation = 0;                       ///< of its signatures
};

/// Not thread-safe. Functions that return asks return those to be sent now.
class Gather {
  public:
    /// Answers of signatures older than `leastGeneration` do not count. `turn` spreads requests over the
    /// replicas of a shard: any number, another one for each request.
    Gather(RoutesPtr routes, std::int64_t atLeast, std::int64_t leastGeneration, std::uint64_t turn);

    [[nodiscard]] std::vector<Ask> start();
    /// An answer. One to an ask that is unknown, failed or answered already is ignored.
    [[nodiscard]] std::vector<Ask> onAnswer(std::uint64_t ask, const Coverage& coverage);
    /// No answer, a refusal, or one that took too long.
    [[nodiscard]] std::vector<Ask> onFailure(std::uint64_t ask);
    /// Routes that were read after `needsRoutes` became true: everybody may be asked again.
    [[nodiscard]] std::vector<Ask> onRoutes(RoutesPtr fresh);

    [[nodiscard]] bool complete() const { return covered_.all(); }
    /// Shards are left of which nobody is there to be asked any more.
    [[nodiscard]] bool needsRoutes() const { return stuck_.any(); }
    /// By the answers accepted so far, whose ids `accepted` tells.
    [[nodiscard]] ShardSet covered() const { return covered_; }
    [[nodiscard]] std::vector<std::uint64_t> accepted() const;
    /// Of the answers accepted; `leastGeneration` before the first.
    [[nodiscard]] std::int64_t generation() const { return generation_; }

  private:
    [[nodiscard]] std::vector<Ask> askFor(const ShardSet& shards);
    [[nodiscard]] bool answers(const Ask& ask, const Coverage& coverage) const;
    static ShardSet shardsOf(const Ask& ask);

    RoutesPtr routes_;
    std::int64_t atLeast_;
    std::uint64_t turn_;
    std::uint64_t lastId_ = 0;
    std::int64_t generation_ = 0;
    std::map<std::uint64_t, Ask> open_;
    std::map<std::uint64_t, Ask> accepted_;
    ShardSet covered_;
    ShardSet stuck_;
    std::map<std::string, ShardSet> tried_;  ///< by server
};

}  // namespace shapedb::cluster
