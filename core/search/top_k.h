// Exact top-k: the k best scores of a snapshot, equal to brute force bit for bit.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/matching/score.h"
#include "core/search/filter.h"
#include "core/search/signature_set.h"

namespace shapedb {

struct SearchOptions {
    std::size_t k = 10;      ///< at least 1
    double threshold = 0.0;  ///< hits have at least this score; [0, 1]
    Filter filter;           ///< applied first: the k best of those that pass
    ScoreOptions score;
    std::optional<std::int64_t> excludeId;  ///< leaves one shape out (a query by key)
};

struct SearchHit {
    SignatureSet::EntryPtr entry;
    double score = 0.0;
};

struct SearchResult {
    std::vector<SearchHit> hits;   ///< by falling score, equal scores by rising id
    std::uint64_t candidates = 0;  ///< in the snapshot
    std::uint64_t filtered = 0;    ///< of these, passed filter and exclusion
    std::uint64_t scored = 0;      ///< of these, not ruled out by a bound: scored in full
};

/// Visits candidates by falling upper bound and stops when no bound can reach the k-th
/// score. Uses the calling thread's oneTBB arena. The counts may vary with the number of
/// threads, the hits never do.
///
/// Errors: kInvalidArgument (k, threshold, kernel width), kCancelled, kDeadlineExceeded,
/// kOutOfMemory.
[[nodiscard]] Result<SearchResult> topK(const Signature& query, const SignatureSet& set,
                                        const SearchOptions& options, const RunContext& context = {});

}  // namespace shapedb
