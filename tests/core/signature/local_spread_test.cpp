// SPDX-License-Identifier: GPL-3.0-or-later
// Spread around points of a rod, a sheet and a ball, and against a plain computation.
#include "core/signature/local_spread.h"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "core/base/random.h"

namespace shapedb {
namespace {

LocalSpread meanOf(const std::vector<LocalSpread>& all) {
    LocalSpread mean;
    for (const LocalSpread& s : all) {
        mean.middle += s.middle / static_cast<double>(all.size());
        mean.shortest += s.shortest / static_cast<double>(all.size());
    }
    return mean;
}

PointCloud box(double x, double y, double z, std::size_t count) {
    Random random(1);
    PointCloud points;
    for (std::size_t i = 0; i < count; ++i) {
        points.push_back({random.uniform(-x, x), random.uniform(-y, y), random.uniform(-z, z)});
    }
    return points;
}

TEST(LocalSpread, TellsRodSheetAndBody) {
    const LocalSpread rod = meanOf(localSpread(box(0.5, 0.004, 0.004, 3000)));
    EXPECT_LT(rod.middle, 0.1);
    const LocalSpread sheet = meanOf(localSpread(box(0.4, 0.3, 0.002, 3000)));
    EXPECT_GT(sheet.middle, 0.8);
    EXPECT_LT(sheet.shortest, 0.1);
    const LocalSpread body = meanOf(localSpread(box(0.3, 0.3, 0.3, 3000)));
    EXPECT_GT(body.shortest, 0.6);
    EXPECT_GT(body.middle, body.shortest);
}

// A cloud so small that all points are within reach of each other, with the coordinate axes as principal
// axes.
TEST(LocalSpread, AgreesWithAPlainComputation) {
    PointCloud points;
    for (const double x : {-0.03, 0.03}) {
        for (const double y : {-0.02, 0.02}) {
            for (const double z : {-0.005, 0.005}) points.push_back({x, y, z});
        }
    }
    const auto all = localSpread(points);
    ASSERT_EQ(all.size(), points.size());
    for (const LocalSpread& s : all) {
        EXPECT_NEAR(s.middle, 2.0 / 3.0, 1e-12);
        EXPECT_NEAR(s.shortest, 1.0 / 6.0, 1e-12);
    }
}

TEST(LocalSpread, IgnoresPointsBeyondItsReach) {
    // Two perpendicular sheets, farther apart than the reach: each looks like a sheet.
    PointCloud points = box(0.2, 0.2, 0.001, 1500);
    for (const Point3& p : box(0.2, 0.001, 0.2, 1500)) points.push_back(p + Point3{0.0, 0.5, 0.0});
    for (const LocalSpread& s : localSpread(points)) EXPECT_LT(s.shortest, 0.1);
    // A single point has no spread.
    EXPECT_TRUE(localSpread({{0, 0, 0}, {1, 0, 0}}).empty());
    EXPECT_EQ(localSpread(box(0.3, 0.3, 0.3, 9000)).size(), kSpreadPlaces);
}

}  // namespace
}  // namespace shapedb
