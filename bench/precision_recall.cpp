// SPDX-License-Identifier: GPL-3.0-or-later
#include "bench/precision_recall.h"

#include <algorithm>

#include "core/base/return_if_error.h"

namespace shapedb::bench {

namespace {

/// Precision at the rank of each right candidate, in the order they are found; empty without any.
std::vector<double> precisions(const ScoreMatrix& scores, const std::vector<std::string>& labels,
                               std::size_t query) {
    std::vector<double> found;
    std::size_t rank = 0;
    for (const std::size_t candidate : rankOthers(scores, labels.size(), query)) {
        ++rank;
        if (labels[candidate] != labels[query]) continue;
        found.push_back(static_cast<double>(found.size() + 1) / static_cast<double>(rank));
    }
    return found;
}

}  // namespace

Result<std::vector<double>> precisionAtRecall(const ScoreMatrix& scores,
                                              const std::vector<std::string>& labels) {
    RETURN_IF_ERROR(checkScoreMatrix(scores, labels.size()));
    std::vector<double> mean(kRecallLevels, 0.0);
    std::size_t queries = 0;
    for (std::size_t query = 0; query < labels.size(); ++query) {
        std::vector<double> best = precisions(scores, labels, query);
        if (best.empty()) continue;
        ++queries;
        for (std::size_t i = best.size() - 1; i > 0; --i) best[i - 1] = std::max(best[i - 1], best[i]);
        for (std::size_t level = 1; level <= kRecallLevels; ++level) {
            // The smallest number of right candidates that reaches the level, in integers.
            const std::size_t needed = (level * best.size() + kRecallLevels - 1) / kRecallLevels;
            mean[level - 1] += best[needed - 1];
        }
    }
    for (double& value : mean) value /= static_cast<double>(std::max<std::size_t>(queries, 1));
    return mean;
}

}  // namespace shapedb::bench
