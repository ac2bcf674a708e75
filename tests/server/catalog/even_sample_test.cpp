// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/catalog/even_sample.h"

#include <gtest/gtest.h>

namespace shapedb::catalog {
namespace {

TEST(EvenSample, IsAllWhereThatIsFewEnough) {
    for (const EvenSample& sample : {EvenSample(5, 0), EvenSample(5, 5), EvenSample(5, 9)}) {
        ASSERT_EQ(sample.size(), 5u);
        for (std::size_t i = 0; i < 5; ++i) EXPECT_EQ(sample.at(i), i);
    }
    EXPECT_EQ(EvenSample(0, 0).size(), 0u);
    EXPECT_EQ(EvenSample(0, 7).size(), 0u);
}

TEST(EvenSample, TakesOneOfEachStretchAndNotAlwaysTheSame) {
    const EvenSample sample(1'000, 100);
    ASSERT_EQ(sample.size(), 100u);
    bool differs = false;
    for (std::size_t i = 0; i < 100; ++i) {
        EXPECT_GE(sample.at(i), 10 * i);
        EXPECT_LT(sample.at(i), 10 * i + 10);
        differs = differs || sample.at(i) % 10 != sample.at(0) % 10;
    }
    EXPECT_TRUE(differs);
}

TEST(EvenSample, HoldsForTheLargestScans) {
    const std::uint64_t total = 10'000'019;
    const EvenSample sample(total, 9'999'000);
    for (std::size_t i = 1; i < sample.size(); i += 97) {
        ASSERT_GT(sample.at(i), sample.at(i - 1));
        ASSERT_GE(sample.at(i), i);
    }
    EXPECT_LT(sample.at(sample.size() - 1), total);
}

}  // namespace
}  // namespace shapedb::catalog
