// SPDX-License-Identifier: GPL-3.0-or-later
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "bench/retrieval_run.h"
#include "core/base/random.h"

namespace shapedb::bench {
namespace {

TEST(PrecisionRecall, PerfectRankingHasPrecisionOneEverywhere) {
    const std::vector<std::string> labels = {"a", "a", "a", "b", "b"};
    ScoreMatrix scores(25, 0.0);
    for (std::size_t q = 0; q < 5; ++q) {
        for (std::size_t c = 0; c < 5; ++c) scores[q * 5 + c] = labels[q] == labels[c] ? 1.0 : 0.0;
    }
    const auto curve = precisionAtRecall(scores, labels);
    ASSERT_TRUE(curve);
    EXPECT_THAT(*curve, ::testing::AllOf(::testing::SizeIs(kRecallLevels), ::testing::Each(1.0)));
}

TEST(PrecisionRecall, AgreesWithAWorkedExample) {
    // Query 0 of class a finds: b, a, a; the two a's ask with the right answers first; b is alone.
    const std::vector<std::string> labels = {"a", "a", "a", "b"};
    const ScoreMatrix scores = {0, 2, 1, 3,  //
                                3, 0, 2, 1,  //
                                3, 2, 0, 1,  //
                                1, 1, 1, 0};
    const auto curve = precisionAtRecall(scores, labels);
    ASSERT_TRUE(curve);
    // Precision 1/2 at half recall, but 2/3 later: the best from there on counts.
    EXPECT_DOUBLE_EQ((*curve)[0], (2.0 / 3.0 + 1.0 + 1.0) / 3.0);
    EXPECT_DOUBLE_EQ((*curve)[kRecallLevels - 1], (2.0 / 3.0 + 1.0 + 1.0) / 3.0);
}

TEST(PrecisionRecall, NeverRises) {
    Random random(3);
    std::vector<std::string> labels;
    for (int i = 0; i < 24; ++i) labels.emplace_back(1, static_cast<char>('a' + i % 3));
    ScoreMatrix scores(24 * 24);
    for (double& score : scores) score = random.uniform();
    const auto curve = precisionAtRecall(scores, labels);
    ASSERT_TRUE(curve);
    for (std::size_t i = 1; i < curve->size(); ++i) EXPECT_LE((*curve)[i], (*curve)[i - 1]);
    EXPECT_GT(curve->back(), 7.0 / 23.0) << "all found: at worst as many right ones as there are";
}

TEST(PrecisionRecall, WithoutQueriesAllIsZero) {
    const auto curve = precisionAtRecall({0.0, 1.0, 1.0, 0.0}, {"a", "b"});
    ASSERT_TRUE(curve);
    EXPECT_THAT(*curve, ::testing::Each(0.0));
}

TEST(PrecisionRecall, RefusesScoresThatAreNotAMatrix) {
    EXPECT_FALSE(precisionAtRecall({0.0}, {"a", "b"}));
    EXPECT_FALSE(precisionAtRecall({0.0, std::numeric_limits<double>::quiet_NaN(), 1.0, 0.0}, {"a", "a"}));
}

}  // namespace
}  // namespace shapedb::bench
