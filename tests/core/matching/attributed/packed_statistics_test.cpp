// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/matching/attributed/packed_statistics.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <vector>

#include <gtest/gtest.h>

#include "core/base/random.h"
#include "core/matching/attributed/attributed_query.h"
#include "tests/core/matching/attributed_signatures.h"

namespace shapedb {
namespace {

ShapeStatistics randomLevels(Random& random) {
    ShapeStatistics levels;
    const std::uint64_t most = 1 + random.below(16);
    for (std::uint8_t& level : levels) level = static_cast<std::uint8_t>(random.below(most));
    return levels;
}

// The plain reference: bin by bin, a reversible statistic in both senses.
std::uint32_t plainSum(const ShapeStatistics& a, const ShapeStatistics& b, Statistic kind) {
    const StatisticLayout& layout = kStatistics[static_cast<std::size_t>(kind)];
    const auto sum = [&](bool reversed) {
        std::uint32_t total = 0;
        for (std::size_t i = 0; i < layout.count; ++i) {
            std::size_t j = i;
            if (reversed) {
                const std::size_t columns = layout.count / layout.reversibleRows;
                j = (layout.reversibleRows - 1u - i / columns) * columns + i % columns;
            }
            total += static_cast<std::uint32_t>(std::abs(a[layout.offset + i] - b[layout.offset + j]));
        }
        return total;
    };
    return layout.reversibleRows > 0 ? std::min(sum(false), sum(true)) : sum(false);
}

TEST(PackedStatistics, UnpackingReversesPacking) {
    Random random(1);
    for (int round = 0; round < 300; ++round) {
        const ShapeStatistics levels = randomLevels(random);
        HalfRow first, second;
        packStatistics(levels, first, second);
        ShapeStatistics back;
        unpackStatistics(first, second, back);
        ASSERT_EQ(back, levels);
    }
}

TEST(PackedStatistics, CutsOffLevelsAboveTheTop) {
    ShapeStatistics levels;
    levels.fill(200);
    HalfRow first, second;
    packStatistics(levels, first, second);
    unpackStatistics(first, second, levels);
    for (const std::uint8_t level : levels) EXPECT_EQ(level, kTopLevel);
}

TEST(PackedStatistics, HalvesHoldEveryStatisticOnce) {
    std::vector<Statistic> all(kFirstHalf.begin(), kFirstHalf.end());
    all.insert(all.end(), kSecondHalf.begin(), kSecondHalf.end());
    std::sort(all.begin(), all.end());
    ASSERT_EQ(all.size(), kStatisticKinds);
    for (std::size_t i = 0; i < all.size(); ++i) EXPECT_EQ(static_cast<std::size_t>(all[i]), i);
}

TEST(PackedStatistics, SumsEqualPlainLoops) {
    Random random(2);
    for (int round = 0; round < 200; ++round) {
        const ShapeStatistics query = randomLevels(random);
        std::vector<ShapeStatistics> others(1 + random.below(20));
        std::vector<HalfRow> first(others.size()), second(others.size());
        for (std::size_t i = 0; i < others.size(); ++i) {
            others[i] = i == 0 ? query : randomLevels(random);
            packStatistics(others[i], first[i], second[i]);
        }
        HalfRow packedFirst, packedSecond;
        packStatistics(query, packedFirst, packedSecond);
        for (const Instructions use : {Instructions::kBest, Instructions::kPortable}) {
            const StatisticsDifference difference(packedFirst, packedSecond, use);
            std::vector<HalfSums> sums(others.size());
            difference.first(first.data(), first.size(), sums.data());
            for (std::size_t i = 0; i < others.size(); ++i) {
                const HalfSums rest = difference.second(second[i]);
                for (std::size_t s = 0; s < kKindsPerHalf; ++s) {
                    ASSERT_EQ(sums[i][s], plainSum(query, others[i], kFirstHalf[s])) << "slot " << s;
                }
                for (std::size_t s = 0; s < kKindsInSecondHalf; ++s) {
                    ASSERT_EQ(rest[s], plainSum(query, others[i], kSecondHalf[s])) << "slot " << s;
                }
            }
        }
    }
}

TEST(PackedStatistics, WeightedSumsEqualTheMeanDistance) {
    Random random(3);
    for (int round = 0; round < 500; ++round) {
        const Signature a = testing_support::randomAttributed(random);
        const Signature b = testing_support::randomAttributed(random);
        const LevelWeights weights =
            levelWeights(groundsOf(PackedShape(a).row()), groundsOf(PackedShape(b).row()));
        double mean = 0.0;
        for (std::size_t kind = 0; kind < kStatisticKinds; ++kind) {
            mean += weights.perLevel[kind] * plainSum(a.attributes->statistics, b.attributes->statistics,
                                                      static_cast<Statistic>(kind));
        }
        const double statistics =
            statisticsDistance(AttributedQuery(a).levelSums(PackedShape(b).row()),
                               groundsOf(PackedShape(a).row()), groundsOf(PackedShape(b).row()));
        const AttributeDistance distance = attributeDistance(statistics, groundsOf(PackedShape(a).row()),
                                                             groundsOf(PackedShape(b).row()), 0.0);
        EXPECT_NEAR(mean, distance.statistics / distance.totalWeight, 1e-12);
        EXPECT_NEAR(weights.partial, 1.0 - distance.containedWeight, 1e-12);

        const double best = attributeScore(distance, 1.0);
        EXPECT_GE(maxScoreAtDistance(mean), best);
        EXPECT_LE(maxScoreAtDistance(mean), best * (1.0 + 1e-6));
        EXPECT_GE(maxDistanceForScore(best), mean);
        EXPECT_LE(maxDistanceForScore(best), mean * (1.0 + 1e-6) + 1e-6);
    }
    EXPECT_EQ(maxDistanceForScore(0.0), INFINITY);
    EXPECT_LT(maxDistanceForScore(1.0), 1e-6);
    EXPECT_EQ(maxScoreAtDistance(0.0), 1.0);
}

}  // namespace
}  // namespace shapedb
