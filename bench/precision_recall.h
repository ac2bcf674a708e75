// SPDX-License-Identifier: GPL-3.0-or-later
// The precision-recall curve of leave-one-out retrieval.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/evaluation/metrics.h"

namespace shapedb::bench {

/// Recall levels 1/20, 2/20 .. 1.
inline constexpr std::size_t kRecallLevels = 20;

/// The mean over all queries of the interpolated precision at each recall level: the best precision
/// at any rank where at least that share of the right candidates has been found. In [0, 1],
/// never rising. Right means the same label; a shape alone in its class is no query; ties break by index.
/// All 0 without queries.
///
/// Errors: those of `checkScoreMatrix`.
[[nodiscard]] Result<std::vector<double>> precisionAtRecall(const ScoreMatrix& scores,
                                                            const std::vector<std::string>& labels);

}  // namespace shapedb::bench
