// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/geometry/depth_buffer.h"

#include <cmath>

#include <gtest/gtest.h>

#include "core/base/random.h"
#include "core/geometry/motion.h"
#include "core/geometry/principal_axes.h"

namespace shapedb {
namespace {

TEST(DepthBuffer, HidesWhatLiesBehindTheNearestPointOfThePixel) {
    DepthBuffer buffer({{0, 0, 0}, {10, 10, 5}}, 1.0);
    buffer.add({0.5, 0.5, 4.0});
    buffer.add({0.6, 0.4, 2.0});
    EXPECT_TRUE(buffer.hides({0.1, 0.9, 1.0}, 2.0));
    EXPECT_FALSE(buffer.hides({0.1, 0.9, 2.0}, 2.0)) << "exactly two behind";
    EXPECT_FALSE(buffer.hides({1.5, 0.5, 0.0}, 2.0)) << "nothing is nearer in the next pixel";
    buffer.add({-1.0, 0.5, 9.0});
    EXPECT_FALSE(buffer.hides({0.5, 0.5, 4.0}, 0.0)) << "points outside hide nothing";
    EXPECT_FALSE(buffer.hides({10.0, 10.0, 0.0}, 0.0)) << "the corner belongs to the box";
}

TEST(DepthBuffer, ViewsAreTurnedWithoutStretching) {
    Random random(4);
    const Point3 towards = randomDirection(random);
    const PointCloud points = {{1, 2, 3}, {-4, 0, 1}, 7.0 * towards};
    const PointCloud viewed = alongView(points, towards);
    for (std::size_t i = 0; i < points.size(); ++i) {
        EXPECT_NEAR(length(viewed[i]), length(points[i]), 1e-12);
        EXPECT_NEAR(viewed[i].z, dot(points[i], towards), 1e-12);
    }
}

TEST(DepthBuffer, APixelHoldsSoManyPoints) {
    EXPECT_DOUBLE_EQ(pixelFor({4.0, 9.0, 1.0}, 16.0, 144), 2.0);
    EXPECT_DOUBLE_EQ(pixelFor({1.0, 0.0, 1.0}, 1.0, 10), 0.01) << "1/1000 wide";
    EXPECT_EQ(pixelFor({0.0, 0.0, 1.0}, 16.0, 100), 0.0);
    EXPECT_TRUE(std::isfinite(pixelFor({1.0, 1.0, 1.0}, 16.0, 0)));
}

TEST(PrincipalAxes, AreThoseOfATurnedBox) {
    Random random(5);
    const Matrix3 turn = randomRotation(random);
    PointCloud points;
    for (int corner = 0; corner < 8; ++corner) {
        const Point3 p{corner & 1 ? 1.0 : -1.0, corner & 2 ? 3.0 : -3.0, corner & 4 ? 2.0 : -2.0};
        points.push_back(rotate(turn, p) + Point3{5, 6, 7});
    }
    const Matrix3 axes = principalAxes(points);
    const Point3 expected[3] = {rotate(turn, {0, 1, 0}), rotate(turn, {0, 0, 1}), rotate(turn, {1, 0, 0})};
    for (std::size_t i = 0; i < 3; ++i) {
        const Point3 axis{axes[i][0], axes[i][1], axes[i][2]};
        EXPECT_NEAR(std::abs(dot(axis, expected[i])), 1.0, 1e-12) << i;
    }
    EXPECT_NEAR(determinant(axes), 1.0, 1e-12);
}

}  // namespace
}  // namespace shapedb
