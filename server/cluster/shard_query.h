// SPDX-License-Identifier: GPL-3.0-or-later
// What the servers of a cluster ask each other about one search.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/search/candidates.h"
#include "server/cluster/gather.h"

namespace shapedb::cluster {

/// A query as it travels.
struct ShardQuery {
    std::int64_t collectionId = 0;
    std::string signature;    ///< core/signature/signature_codec.h
    std::string surface;      ///< core/fit/surface_points_codec.h; empty: nothing is laid on it
    ScoreOptions score;       ///< SearchOptions::score of all that is asked about it
    bool background = false;  ///< one of a batch
};

struct FindRequest {
    Ask ask;
    std::shared_ptr<const ShardQuery> query;
    CandidateSearch search;
    /// Set: only CandidateSource::findOfGroups, of these.
    std::optional<std::vector<OwnGroup>> among{};
};

struct FindAnswer {
    Coverage coverage;
    Candidates found;  ///< with FindRequest::among in `ofGroups`
};

struct FitRequest {
    std::shared_ptr<const ShardQuery> query;
    std::vector<FittedShape> shapes;
    FitOptions options;
    /// False: CandidateSource::fitAll; true: preferUnmirroredAll, of shapes with their fits.
    bool preferUnmirrored = false;
};
using FitAnswer = std::vector<std::shared_ptr<const FitResult>>;

/// How requests reach another server. Thread-safe.
class ShardTransport {
  public:
    /// A request under way. Its destructor waits until `done` was called.
    class Request {
      public:
        virtual ~Request() = default;
        virtual void cancel() = 0;
    };
    template <typename Answer>
    using Done = std::function<void(Result<Answer>)>;

    virtual ~ShardTransport() = default;
    /// Calls `done` once, on any thread: with the other server's answer or error, or kUnavailable,
    /// kDeadlineExceeded or kCancelled.
    [[nodiscard]] virtual std::unique_ptr<Request> find(const std::string& server, const FindRequest& request,
                                                        RunContext::Clock::time_point until,
                                                        Done<FindAnswer> done) = 0;
    [[nodiscard]] virtual std::unique_ptr<Request> fit(const std::string& server, const FitRequest& request,
                                                       RunContext::Clock::time_point until,
                                                       Done<FitAnswer> done) = 0;
};

}  // namespace shapedb::cluster
