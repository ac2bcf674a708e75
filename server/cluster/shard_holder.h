// SPDX-License-Identifier: GPL-3.0-or-later
// Answers what other servers ask this one about its shards.
#pragma once

#include <functional>

#include "core/base/error.h"
#include "core/search/candidates.h"
#include "server/cluster/member.h"
#include "server/cluster/shard_query.h"

namespace shapedb::cluster {

/// Thread-safe.
class ShardHolder {
  public:
    struct Parts {
        Member& member;
        SurfaceOf surfaceOf;
        /// Runs work on the processors that searches share, with the priority of batches if `background`.
        std::function<Result<void>(bool background, const std::function<Result<void>()>& work)> run;
    };

    explicit ShardHolder(Parts parts) : parts_(std::move(parts)) {}

    /// Errors: those of Member::content, of CandidateSource, and of the decoders of the query.
    [[nodiscard]] Result<FindAnswer> find(const FindRequest& request, const RunContext& context) const;
    /// Of shapes of any shard: it reads their surface points from the store. Errors: as above.
    [[nodiscard]] Result<FitAnswer> fit(const FitRequest& request, const RunContext& context) const;

  private:
    Parts parts_;
};

}  // namespace shapedb::cluster
