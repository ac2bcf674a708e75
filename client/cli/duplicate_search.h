// SPDX-License-Identifier: GPL-3.0-or-later
// All pairs of a collection that score at least a threshold, and the groups that they make.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "client/api/client.h"
#include "client/cli/parameters.h"
#include "core/base/error.h"
#include "core/base/run_context.h"

namespace shapedb::cli {

struct DuplicateOptions {
    std::string collection;
    std::string filter;
    double threshold = 0.9;  ///< of the scores of signatures, [0, 1]
    client::CompareOptions score;
    ClusterFlags cluster;
    bool compare = true;  ///< whether the shapes of each pair are laid on each other
    unsigned jobs = 4;    ///< pairs compared at the same time
};

/// One shape laid on another.
struct PairFit {
    double score = 0.0;
    Verdict verdict = Verdict::kNone;
    std::optional<client::FitPose> pose;  ///< if both have surface points
    std::optional<bool> mirrored;         ///< whether it fits only as a mirror image; set with `pose`
};

struct DuplicatePair {
    std::size_t a = 0;  ///< into DuplicateReport::shapes; a < b
    std::size_t b = 0;
    double signatureScore = 0.0;  ///< the same from either side
    std::optional<PairFit> fit;   ///< of b laid on a; not set unless compared

    /// The score of the fit or, without one, of the signatures.
    [[nodiscard]] double score() const { return fit ? fit->score : signatureScore; }
};

struct DuplicateReport {
    std::vector<client::Shape> shapes;  ///< all that were searched, by id
    std::vector<DuplicatePair> pairs;   ///< by score, best first; then by shapes
    /// Shapes that hang together by pairs, by id; groups by their first shapes.
    std::vector<std::vector<std::size_t>> groups;
    double covered = 1.0;  ///< the least share of the collection that a shape was searched for in
};

/// Every shape is searched for among the others, many in one call, and what bounds rule out is not scored: as
/// exact as comparing each with each. Where one has more partners than a search may return, those that have
/// are scored here, each with each. A shape that goes meanwhile is left out.
///
/// `progress`: what is done, and how much of it. Errors: those of the calls; kInvalidArgument (threshold).
[[nodiscard]] Result<DuplicateReport> findDuplicates(
    const client::Client& client, const DuplicateOptions& options,
    const std::function<void(const char* what, std::uint64_t done, std::uint64_t total)>& progress,
    const RunContext& context);

/// How a shape hangs together with those of its group that are listed before it.
struct DuplicateLink {
    std::size_t shape = 0;
    const DuplicatePair* pair = nullptr;  ///< with one listed before; null for the first
};

/// A group as a list: after its first shape always the one that has the best pair with any listed so far,
/// and that pair. Nobody is shown as the poor likeness of one where a better partner is listed. `pairs`:
/// at least those of the group, best first.
[[nodiscard]] std::vector<DuplicateLink> linksOf(const std::vector<std::size_t>& group,
                                                 const std::vector<const DuplicatePair*>& pairs);

/// Groups of the shapes below `count` that the pairs join.
[[nodiscard]] std::vector<std::vector<std::size_t>> groupsOf(const std::vector<DuplicatePair>& pairs,
                                                             std::size_t count);

}  // namespace shapedb::cli
