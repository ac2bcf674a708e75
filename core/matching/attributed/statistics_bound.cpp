// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/matching/attributed/statistics_bound.h"

#include <algorithm>
#include <cmath>

namespace shapedb {

namespace {

constexpr std::size_t kQualities = 256;
constexpr std::size_t kGrounds = 2 * kQualities;  // every quality, then every quality of earlier versions
constexpr std::size_t kRowsAtOnce = 256;          // their sums fit the first-level cache

double weighted(const HalfSums& sums, const std::array<double, kKindsPerHalf>& weights) {
    double sum = 0.0;
    for (std::size_t s = 0; s < kKindsPerHalf; ++s) sum += weights[s] * sums[s];
    return sum;
}

}  // namespace

StatisticsBound::StatisticsBound(const AttributedQuery& query, StatisticsRule rule)
    : query_(query),
      queryScale_(query.scale()),
      compareSizes_(rule == StatisticsRule::kWholeAndSize),
      first_(kGrounds),
      second_(kGrounds) {
    // Weights depend on the grounds of both. A table of all that a row may have saves computing them for each
    // row.
    for (std::size_t grounds = 0; grounds < kGrounds; ++grounds) {
        const LevelWeights weights =
            levelWeights(query.grounds(), {static_cast<std::uint8_t>(grounds), grounds >= kQualities});
        const double share = rule == StatisticsRule::kPartial ? weights.partial : 1.0;
        for (std::size_t s = 0; s < kKindsPerHalf; ++s) {
            first_[grounds][s] = share * weights.perLevel[static_cast<std::size_t>(kFirstHalf[s])];
        }
        for (std::size_t s = 0; s < kKindsInSecondHalf; ++s) {
            second_[grounds][s] = share * weights.perLevel[static_cast<std::size_t>(kSecondHalf[s])];
        }
    }
}

void StatisticsBound::scan(const ShapeRows& rows, const std::vector<std::uint8_t>& wanted, double least,
                           std::vector<Survivor>& left, ScanCounts& counts) const {
    if (rows.attributedCount == 0) return;
    const double farthest = maxDistanceForScore(least);
    const bool all = rows.attributedCount == rows.count;
    std::array<HalfSums, kRowsAtOnce> sums;
    for (std::size_t begin = 0; begin < rows.count; begin += kRowsAtOnce) {
        const std::size_t count = std::min(kRowsAtOnce, rows.count - begin);
        query_.difference().first(rows.firstHalves + begin, count, sums.data());
        for (std::size_t i = 0; i < count; ++i) {
            const std::size_t row = begin + i;
            const std::size_t grounds = rows.qualities[row] + kQualities * rows.earlier[row];
            double distance = weighted(sums[i], first_[grounds]);
            // Before anything else is looked at, since it rules out most rows. Rows without attributes have
            // zeros as statistics; they are dropped below.
            if (distance > farthest) continue;
            if ((!wanted.empty() && wanted[row] == 0) || (!all && !rows.attributed(row))) continue;
            ++counts.left[kFirstHalfStage];
            const HalfSums rest = query_.difference().second(rows.secondHalves[row]);
            distance += weighted(rest, second_[grounds]);
            if (compareSizes_) distance = std::hypot(distance, octavesBetween(queryScale_, rows.scales[row]));
            if (distance > farthest) continue;
            ++counts.left[kStatisticsStage];
            left.push_back({maxScoreAtDistance(distance), static_cast<std::uint32_t>(row),
                            Findings(joined(sums[i], rest))});
        }
    }
}

}  // namespace shapedb
