// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/matching/kernel.h"

#include <cmath>

#include <gtest/gtest.h>

namespace shapedb {
namespace {

TEST(Kernel, FallsFromOneToZeroNearAGaussian) {
    EXPECT_EQ(kernel(0.0, 0.1), 1.0);
    EXPECT_EQ(kernel(0.125, 0.125), 0.0);
    EXPECT_EQ(kernel(0.0801, 0.1), 0.0);
    EXPECT_EQ(kernel(1e30, 0.1), 0.0);
    EXPECT_DOUBLE_EQ(kernel(0.04, 0.1), 1.0 / 16.0);
    double before = 1.0;
    for (double d = 0.001; d < 0.29; d += 0.001) {
        const double now = kernel(d * d, 0.1);
        EXPECT_TRUE(now < before || now == 0.0) << d;
        EXPECT_NEAR(now, std::exp(-d * d / 0.02), 0.1) << d;
        before = now;
    }
}

TEST(LeastGap, IsJustBelowTheGap) {
    EXPECT_EQ(leastGap(1.0, 1.0), 0.0);
    EXPECT_EQ(leastGap(0.0, 0.0), 0.0);
    EXPECT_LT(leastGap(3.0, 1.0), 2.0);
    EXPECT_GT(leastGap(3.0, 1.0), 2.0 - 1e-12);
    EXPECT_EQ(leastGap(-1.0, 2.0), leastGap(2.0, -1.0));
    EXPECT_EQ(leastGap(1.0, 1.0 + 1e-15), 0.0);
}

TEST(BelowOne, CutsOffOnlyOne) {
    EXPECT_LT(belowOne(1.0), 1.0);
    EXPECT_EQ(belowOne(belowOne(1.0)), belowOne(1.0));
    EXPECT_EQ(belowOne(0.999), 0.999);
}

}  // namespace
}  // namespace shapedb
