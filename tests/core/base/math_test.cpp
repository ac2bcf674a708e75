// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/base/math.h"

#include <cmath>

#include <gtest/gtest.h>

namespace shapedb {
namespace {

TEST(Math, PiIsTheNearestDouble) { EXPECT_EQ(kPi, std::acos(-1.0)); }

TEST(Math, AnglesConvertBothWays) {
    EXPECT_EQ(toRadians(180.0), kPi);
    EXPECT_EQ(toRadians(-90.0), -kPi / 2);
    EXPECT_EQ(toDegrees(kPi), 180.0);
    EXPECT_EQ(toDegrees(0.0), 0.0);
    for (double degrees = -720.0; degrees <= 720.0; degrees += 7.5) {
        EXPECT_NEAR(toDegrees(toRadians(degrees)), degrees, 1e-12);
        EXPECT_NEAR(std::cos(toRadians(degrees + 360.0)), std::cos(toRadians(degrees)), 1e-12);
    }
}

}  // namespace
}  // namespace shapedb
