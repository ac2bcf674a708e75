// SPDX-License-Identifier: GPL-3.0-or-later
// The first rungs of the ladder of bounds: which rows the statistics alone rule out.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/matching/attributed/attributed_query.h"
#include "core/matching/scorer.h"

namespace shapedb {

/// Which part of a score the statistics bound.
enum class StatisticsRule {
    kWhole,         ///< the mean distance
    kWholeAndSize,  ///< with the difference of sizes
    kPartial,       ///< the share of the mean distance beside the contained parts
};

/// The stages of a scan, as ScanCounts count them: what they leave is not ruled out by
enum StatisticsStage : std::size_t {
    kFirstHalfStage = 0,   ///< the first half of its statistics
    kStatisticsStage = 1,  ///< all of them
};

/// Bounds of many rows against one query. Immutable, thread-safe; `query` must outlive it.
class StatisticsBound {
  public:
    StatisticsBound(const AttributedQuery& query, StatisticsRule rule);

    /// Like Scorer::scan, for attributed rows: finds those that could score `least` if the rest of them
    /// agreed fully. Survivor::findings are the LevelSums.
    void scan(const ShapeRows& rows, const std::vector<std::uint8_t>& wanted, double least,
              std::vector<Survivor>& left, ScanCounts& counts) const;

  private:
    using HalfWeights = std::array<double, kKindsPerHalf>;

    const AttributedQuery& query_;
    double queryScale_;
    bool compareSizes_;
    std::vector<HalfWeights> first_, second_;  // by the grounds of the row
};

}  // namespace shapedb
