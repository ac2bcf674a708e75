#include "core/search/statistics_bound.h"

#include <algorithm>
#include <cmath>

namespace shapedb {

namespace {

constexpr std::size_t kQualities = 256;
constexpr std::size_t kRowsAtOnce = 256;  // their sums fit the first-level cache

double weighted(const HalfSums& sums, const std::array<double, kKindsPerHalf>& weights) {
    double sum = 0.0;
    for (std::size_t s = 0; s < kKindsPerHalf; ++s) sum += weights[s] * sums[s];
    return sum;
}

}  // namespace

StatisticsBound::StatisticsBound(const Signature& query, const ScoreOptions& options, Instructions use)
    : difference_(query.attributes->statistics, use),
      queryScale_(query.scale),
      keepScale_(options.keepScale && !options.partial),
      first_(kQualities),
      second_(kQualities) {
    for (std::size_t quality = 0; quality < kQualities; ++quality) {
        const LevelWeights weights =
            levelWeights(query.attributes->quality, static_cast<std::uint8_t>(quality));
        const double share = options.partial ? weights.partial : 1.0;
        for (std::size_t s = 0; s < kKindsPerHalf; ++s) {
            first_[quality][s] = share * weights.perLevel[static_cast<std::size_t>(kFirstHalf[s])];
            second_[quality][s] = share * weights.perLevel[static_cast<std::size_t>(kSecondHalf[s])];
        }
    }
}

void StatisticsBound::scan(const SignatureBlock& block, const std::vector<std::uint8_t>& wanted,
                           double needed, std::vector<Left>& left, Counts& counts) const {
    if (block.attributedCount() == 0) return;
    const double farthest = maxDistanceForScore(needed);
    const bool all = block.attributedCount() == block.size();
    std::array<HalfSums, kRowsAtOnce> sums;
    for (std::size_t begin = 0; begin < block.size(); begin += kRowsAtOnce) {
        const std::size_t count = std::min(kRowsAtOnce, block.size() - begin);
        difference_.first(block.firstHalf() + begin, count, sums.data());
        for (std::size_t i = 0; i < count; ++i) {
            const std::size_t row = begin + i;
            const std::uint8_t quality = block.quality(row);
            double distance = weighted(sums[i], first_[quality]);
            if (distance > farthest) continue;
            if ((!wanted.empty() && wanted[row] == 0) || (!all && !block.attributed(row))) continue;
            ++counts.afterFirstHalf;
            distance += weighted(difference_.second(block.secondHalf()[row]), second_[quality]);
            if (keepScale_) distance = std::hypot(distance, octavesBetween(queryScale_, block.scale(row)));
            if (distance > farthest) continue;
            ++counts.afterStatistics;
            left.push_back({static_cast<std::uint32_t>(row), distance});
        }
    }
}

}  // namespace shapedb
