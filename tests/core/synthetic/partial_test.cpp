// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/synthetic/partial.h"

#include <gtest/gtest.h>

#include "core/synthetic/named_shapes.h"

namespace shapedb {
namespace {

PointCloud sphere() { return *sampleBoundary(makeSphere().solid, 20000, 3); }

TEST(Partial, ACameraSeesTheNearHalfOfASphere) {
    const Point3 towards{0.6, 0.0, 0.8};
    const PointCloud seen = seenFrom(sphere(), towards);
    EXPECT_GT(seen.size(), 8000u);
    EXPECT_LT(seen.size(), 12500u);
    std::size_t behind = 0;
    for (const Point3& p : seen) behind += dot(p, towards) < -0.4 ? 1 : 0;
    // Where a pixel happens to hold no point of the front.
    EXPECT_LT(behind, 30u);
}

TEST(Partial, ACameraSeesNothingBehindAWall) {
    PointCloud points;
    for (int i = 0; i < 100; ++i) {
        for (int j = 0; j < 100; ++j) {
            points.push_back({0.01 * i, 0.01 * j, 0.0});
            if (i < 50) points.push_back({0.01 * i, 0.01 * j, 1.0});
        }
    }
    for (const Point3& p : seenFrom(points, {0.0, 0.0, 1.0})) {
        EXPECT_TRUE(p.z == 1.0 || p.x >= 0.46) << p.x;
    }
    EXPECT_TRUE(seenFrom({}, {0.0, 0.0, 1.0}).empty());
    EXPECT_EQ(seenFrom({{1, 2, 3}}, {0.0, 0.0, 1.0}).size(), 1u);
}

TEST(Partial, ACutLeavesTheShareThatLiesLeastFar) {
    const PointCloud all = sphere();
    const PointCloud left = cutBelow(all, {0.0, 0.0, 1.0}, 0.65);
    ASSERT_EQ(left.size(), 13000u);
    // The area of a sphere below a height grows in proportion to it.
    for (const Point3& p : left) EXPECT_LT(p.z, 0.33);
    EXPECT_EQ(cutBelow(all, {1.0, 0.0, 0.0}, 1.0), all);
    EXPECT_TRUE(cutBelow(all, {1.0, 0.0, 0.0}, 0.0).empty());
}

TEST(Partial, AHoleIsEmpty) {
    const PointCloud left = withHole(sphere(), {0.0, 0.0, 1.0}, 0.5);
    EXPECT_LT(left.size(), 19000u);
    for (const Point3& p : left) EXPECT_GT(distance(p, {0.0, 0.0, 1.0}), 0.5);
}

}  // namespace
}  // namespace shapedb
