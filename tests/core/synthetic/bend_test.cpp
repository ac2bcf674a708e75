// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/synthetic/bend.h"

#include <cmath>

#include <gtest/gtest.h>

#include "core/base/math.h"

namespace shapedb {
namespace {

PointCloud bar() {
    PointCloud points;
    for (int i = 0; i <= 200; ++i) {
        for (const double y : {-0.1, 0.1}) {
            for (const double z : {-0.05, 0.05}) points.push_back({0.01 * i + 3.0, y, z - 2.0});
        }
    }
    return points;
}

TEST(Bend, MakesAnArcOfTheSameLength) {
    const PointCloud straight = bar();
    const PointCloud arc = bent(straight, kPi / 2.0);
    ASSERT_EQ(arc.size(), straight.size());
    const auto middle = [](const PointCloud& cloud, std::size_t i) {
        return 0.25 * (cloud[4 * i] + cloud[4 * i + 1] + cloud[4 * i + 2] + cloud[4 * i + 3]);
    };
    double arcLength = 0.0;
    for (std::size_t i = 1; i <= 200; ++i) arcLength += length(middle(arc, i) - middle(arc, i - 1));
    EXPECT_NEAR(arcLength, 2.0, 0.001);
    // The chord of a quarter of a circle of length 2.
    const double radius = 2.0 / (kPi / 2.0);
    EXPECT_NEAR(length(middle(arc, 200) - middle(arc, 0)), radius * std::sqrt(2.0), 0.001);
    // Across, nothing changes.
    for (std::size_t i = 0; i < arc.size(); i += 4) {
        EXPECT_NEAR(length(arc[i] - arc[i + 3]), length(straight[i] - straight[i + 3]), 1e-9);
    }
}

TEST(Bend, HardlyBendsByASmallAngle) {
    const PointCloud straight = bar();
    const PointCloud arc = bent(straight, 1e-6);
    for (std::size_t i = 1; i < arc.size(); ++i) {
        EXPECT_NEAR(length(arc[0] - arc[i]), length(straight[0] - straight[i]), 1e-5);
    }
}

TEST(Bend, LeavesAPointWhereItIs) {
    const PointCloud same = bent({{1, 2, 3}, {1, 2, 3}}, 1.0);
    EXPECT_EQ(same.front(), (Point3{1, 2, 3}));
}

}  // namespace
}  // namespace shapedb
