// SPDX-License-Identifier: GPL-3.0-or-later
// The candidates of a search in a collection whose shards several servers hold: each request goes to one
// holder of each shard, and what they find is put together (gather.h, core/search/candidates.h).
#pragma once

#include <atomic>
#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "core/search/candidates.h"
#include "server/cluster/member.h"
#include "server/cluster/shard_holder.h"
#include "server/cluster/shard_query.h"

namespace shapedb::cluster {

/// What one search asks for, beside its options.
struct ShardSearch {
    std::int64_t collectionId = 0;
    std::int64_t generation = 0;  ///< of the signatures, as the query was read
    std::int64_t atLeast = 0;     ///< the last change that the answer must know
    bool allowPartial = false;    ///< an answer about some of the shards is better than none
    bool background = false;
};

/// Used by the thread of its search alone, as far as `find` is concerned.
class ShardCandidates final : public CandidateSource {
  public:
    struct Parts {
        Member& member;
        const ShardHolder& own;
        ShardTransport& transport;
    };

    /// `surface`: null if nothing is laid on the query. May throw std::bad_alloc.
    ShardCandidates(Parts parts, const ShardSearch& search, const Signature& query,
                    const SurfacePoints* surface, const ScoreOptions& score);

    [[nodiscard]] const std::shared_ptr<const Scorer>& scorer() const override { return scorer_; }
    /// Errors also: kUnavailable (some shards have no holder that answers); kNotReady (the signatures are of
    /// another generation than the query: read it again).
    [[nodiscard]] Result<Candidates> find(const CandidateSearch& search,
                                          const RunContext& context) const override;
    [[nodiscard]] Result<std::vector<Candidate>> findOfGroups(const SearchOptions& options,
                                                              const std::vector<OwnGroup>& groups,
                                                              const RunContext& context) const override;
    [[nodiscard]] Result<FitAnswer> fitAll(const std::vector<std::int64_t>& ids, const FitOptions& options,
                                           const RunContext& context) const override;
    [[nodiscard]] Result<FitAnswer> preferUnmirroredAll(const std::vector<FittedShape>& shapes,
                                                        const FitOptions& options,
                                                        const RunContext& context) const override;

    /// Share of the shards that all answers so far cover; 1 unless partial answers are allowed.
    [[nodiscard]] double covered() const { return covered_; }
    /// The last `find` failed because a rebuild has been put in place.
    [[nodiscard]] bool superseded() const { return superseded_; }

  private:
    class Scatter;
    Result<std::vector<Candidates>> gather(const CandidateSearch& search,
                                           const std::optional<std::vector<OwnGroup>>& among,
                                           const RunContext& context) const;
    Result<FitAnswer> lay(const std::vector<FittedShape>& shapes, const FitOptions& options,
                          bool preferUnmirrored, const RunContext& context) const;

    const Parts parts_;
    const ShardSearch search_;
    std::shared_ptr<const ShardQuery> query_;
    std::shared_ptr<const Scorer> scorer_;
    const std::uint64_t turn_;
    /// Who answered for each shard: there its shapes are laid on the query.
    mutable std::array<std::string, kShards> holders_;
    mutable double covered_ = 1.0;
    mutable bool superseded_ = false;
};

}  // namespace shapedb::cluster
