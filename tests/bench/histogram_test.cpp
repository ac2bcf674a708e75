// SPDX-License-Identifier: GPL-3.0-or-later
#include "bench/histogram.h"

#include <gtest/gtest.h>

namespace shapedb::bench {
namespace {

TEST(Histogram, DistancesOfAWorkedExample) {
    const Histogram a = {0.5F, 0.0F, 0.5F};
    const Histogram b = {0.25F, 0.0F, 0.75F};
    EXPECT_DOUBLE_EQ(l1Distance(a, b), 0.5);
    EXPECT_DOUBLE_EQ(chiSquareDistance(a, b), 0.0625 / 0.75 + 0.0625 / 1.25);
}

TEST(Histogram, DistancesAreSymmetricAndZeroForTheSame) {
    const Histogram a = {0.1F, 0.2F, 0.0F, 0.7F};
    const Histogram b = {0.3F, 0.0F, 0.0F, 0.7F};
    for (const auto distance : {l1Distance, chiSquareDistance}) {
        EXPECT_EQ(distance(a, a), 0.0);
        EXPECT_EQ(distance(a, b), distance(b, a));
        EXPECT_GT(distance(a, b), 0.0);
    }
}

TEST(Histogram, WithNothingInCommonChiSquareIsTheSumOfBoth) {
    EXPECT_DOUBLE_EQ(chiSquareDistance({1.0F, 0.0F}, {0.0F, 1.0F}), 2.0);
    EXPECT_DOUBLE_EQ(l1Distance({1.0F, 0.0F}, {0.0F, 1.0F}), 2.0);
}

}  // namespace
}  // namespace shapedb::bench
