// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/preparation/thin.h"

#include <gtest/gtest.h>

#include "core/base/random.h"
#include "core/geometry/motion.h"

namespace shapedb {
namespace {

PointCloud scattered(std::size_t count) {
    Random random(11);
    PointCloud points;
    for (std::size_t i = 0; i < count; ++i)
        points.push_back({random.uniform(), random.uniform(), random.normal()});
    return points;
}

ThinnedPoints thinned(const PointCloud& points, double spacing) {
    auto result = thin(points, NeighbourIndex(points), spacing);
    return result ? std::move(*result) : ThinnedPoints{};
}

TEST(Thin, KeepsPointsApartAndCoversAllOthers) {
    const PointCloud points = scattered(2000);
    constexpr double kSpacing = 0.15;
    const ThinnedPoints kept = thinned(points, kSpacing);
    ASSERT_LT(kept.points.size(), points.size());
    for (std::size_t i = 0; i < kept.points.size(); ++i) {
        for (std::size_t j = 0; j < i; ++j) ASSERT_GT(distance(kept.points[i], kept.points[j]), kSpacing);
    }
    ASSERT_EQ(kept.siteOfPoint.size(), points.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
        double nearest = 1e300;
        for (const Point3& site : kept.points) nearest = std::min(nearest, distance(site, points[i]));
        EXPECT_LE(nearest, kSpacing);
        EXPECT_EQ(distance(kept.points[kept.siteOfPoint[i]], points[i]), nearest);
    }
}

TEST(Thin, KeepsSparseCloudsWhole) {
    const PointCloud points = scattered(50);
    EXPECT_EQ(thinned(points, 1e-6).points, points);
    EXPECT_EQ(thinned(points, 0.0).points, points);
}

TEST(Thin, DoesNotDependOnThePose) {
    const PointCloud points = scattered(1500);
    Random random(2);
    Motion motion;
    motion.rotation = randomRotation(random);
    motion.translation = {0.3, 0.1, -0.2};
    EXPECT_EQ(thinned(points, 0.1).siteOfPoint, thinned(applyToCloud(motion, points), 0.1).siteOfPoint);
}

TEST(Thin, AcceptsAnEmptyCloud) { EXPECT_TRUE(thinned({}, 1.0).points.empty()); }

}  // namespace
}  // namespace shapedb
