// SPDX-License-Identifier: GPL-3.0-or-later
// Exact top-k: the k best scores of a snapshot, equal to brute force bit for bit.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/matching/scorer.h"
#include "core/search/filter.h"
#include "core/search/grouping.h"
#include "core/search/signature_set.h"

namespace shapedb {

struct SearchOptions {
    std::size_t k = 10;                     ///< at least 1
    double threshold = 0.0;                 ///< hits have at least this score; [0, 1]
    Filter filter;                          ///< applied first: the k best of those that pass
    ScoreOptions score;                     ///< not read when a scorer is given
    std::optional<std::int64_t> excludeId;  ///< leaves one shape out (a query by key)
    /// The k groups whose best hits are best, with the best hits of each; nothing: no groups.
    std::optional<Grouping> grouping{};
};

/// Errors: kInvalidArgument (k, threshold, hits of a group).
[[nodiscard]] Result<void> validate(const SearchOptions& options);

struct SearchHit {
    std::int64_t id = 0;
    double score = 0.0;
};

/// How many candidates each stage of a search left to the next.
struct SearchCounts {
    std::uint64_t candidates = 0;  ///< in the snapshot
    std::uint64_t filtered = 0;    ///< of these, passed filter and exclusion
    ScanCounts scans;              ///< of these, left by each stage of the scorer's scans
    std::uint64_t scored = 0;      ///< nor ruled out one by one: scored in full
};

struct SearchResult {
    /// In descending order of score, ties in ascending order of id; with groups so within each, and group
    /// after group in the order of their best hits.
    std::vector<SearchHit> hits;
    SearchCounts counts;   ///< with groups: of the search for the best hit of each
    double seconds = 0.0;  ///< taken
    /// What scored the hits, to explain them; null when the caller gave the scorer.
    std::shared_ptr<const Scorer> scorer;
};

/// Uses the calling thread's oneTBB arena. The counts may vary with the number of threads, the hits never do.
///
/// Errors: kInvalidArgument (k, threshold, kernel width; a query with points and weights alone where
/// signatures have attributes), kCancelled, kDeadlineExceeded, kOutOfMemory.
[[nodiscard]] Result<SearchResult> topK(const Signature& query, const SignatureSet& set,
                                        const SearchOptions& options, const RunContext& context = {});

/// The same with any scorer. Rows that it does not compare are no hits. Errors: as above, except for
/// what concerns the query.
[[nodiscard]] Result<SearchResult> topK(const Scorer& scorer, const SignatureSet& set,
                                        const SearchOptions& options, const RunContext& context = {});

/// The first half of a search with groups (`options.grouping`): the best hit of each of the k groups whose
/// best hits are best, best first. The sets of several servers are searched so by halves. Errors: as above.
[[nodiscard]] Result<SearchResult> bestOfGroups(const Scorer& scorer, const SignatureSet& set,
                                                const SearchOptions& options, const RunContext& context = {});
/// The second half: of each of `groups` the best hits that it may have, all of them best first. `groups`: no
/// two alike; what they point to must live meanwhile. Errors: as above.
[[nodiscard]] Result<SearchResult> hitsOfGroups(const Scorer& scorer, const SignatureSet& set,
                                                const SearchOptions& options,
                                                const std::vector<GroupValue>& groups,
                                                const RunContext& context = {});

struct BatchQuery {
    Signature signature;
    std::optional<std::int64_t> excludeId;  ///< instead of SearchOptions::excludeId
};

/// `error`, saying which query of a batch it is about, counted from 0.
[[nodiscard]] Error ofQuery(std::size_t i, Error error);

/// `topK` of many queries, each on one thread, as many at once as the arena has: none waits for another.
/// Results in the order of the queries. The first error ends all and names its query ("query 3: ...",
/// counted from 0). Errors: as `topK`.
[[nodiscard]] Result<std::vector<SearchResult>> topKBatch(const std::vector<BatchQuery>& queries,
                                                          const SignatureSet& set,
                                                          const SearchOptions& options,
                                                          const RunContext& context = {});

}  // namespace shapedb
