// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/preparation/outliers.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "core/base/math.h"
#include "core/base/random.h"
#include "core/geometry/motion.h"

namespace shapedb {
namespace {

constexpr double kRatio = 3.0;

PointCloud sphere(std::size_t count, Random& random) {
    PointCloud points;
    while (points.size() < count) {
        const Point3 d{random.normal(), random.normal(), random.normal()};
        points.push_back((1.0 / length(d)) * d);
    }
    return points;
}

std::vector<std::uint8_t> outliersOf(const PointCloud& points) {
    const auto outliers = findOutliers(points, NeighbourIndex(points), kRatio);
    return outliers ? outliers->isOutlier : std::vector<std::uint8_t>{};
}

std::size_t count(const std::vector<std::uint8_t>& outliers, std::size_t begin, std::size_t end) {
    return static_cast<std::size_t>(std::count(outliers.begin() + static_cast<std::ptrdiff_t>(begin),
                                               outliers.begin() + static_cast<std::ptrdiff_t>(end), 1));
}

TEST(FindOutliers, FindsHardlyAnyOnACleanSurface) {
    Random random(1);
    const PointCloud points = sphere(5000, random);
    EXPECT_LE(count(outliersOf(points), 0, points.size()), 3u);
}

TEST(FindOutliers, FindsAHazeAroundTheShape) {
    Random random(2);
    PointCloud points = sphere(10000, random);
    const std::size_t clean = points.size();
    for (int i = 0; i < 100; ++i) {
        points.push_back({random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0)});
    }
    const auto outliers = outliersOf(points);
    ASSERT_EQ(outliers.size(), points.size());
    // Those that happen to lie near the surface cannot be told from it.
    std::size_t far = 0;
    for (std::size_t i = clean; i < points.size(); ++i) {
        if (std::abs(length(points[i]) - 1.0) < 0.25) continue;
        ++far;
        EXPECT_EQ(outliers[i], 1) << i;
    }
    EXPECT_GT(far, 30u);
    EXPECT_LE(count(outliers, 0, clean), 10u);
}

TEST(FindOutliers, FindsASmallDistantCluster) {
    Random random(3);
    PointCloud points = sphere(5000, random);
    for (int i = 0; i < 30; ++i) {
        points.push_back({5.0 + 0.01 * random.normal(), 0.01 * random.normal(), 0.01 * random.normal()});
    }
    const auto outliers = outliersOf(points);
    EXPECT_EQ(count(outliers, 5000, 5030), 30u);
    EXPECT_LE(count(outliers, 0, 5000), 3u);
}

TEST(FindOutliers, KeepsASparseRegionAndAThinPart) {
    Random random(4);
    PointCloud points = sphere(6000, random);
    const std::size_t dense = points.size();
    // The far half of another sphere at a ninth of the density, and a rod as thin as the spacing.
    const PointCloud sparse = sphere(1400, random);
    for (const Point3& p : sparse) {
        if (p.x > 0.0) points.push_back({p.x * 2.0 - 0.2, p.y * 2.0, p.z * 2.0});
    }
    const std::size_t rod = points.size();
    for (int i = 0; i < 400; ++i) {
        const double angle = random.uniform(0.0, 2.0 * kPi);
        points.push_back({-1.0 - random.uniform(0.0, 2.0), 0.03 * std::cos(angle), 0.03 * std::sin(angle)});
    }
    const auto outliers = outliersOf(points);
    EXPECT_LE(count(outliers, dense, rod), 3u);
    EXPECT_LE(count(outliers, rod, points.size()), 3u);
}

TEST(FindOutliers, KeepsALargerSeparatePart) {
    Random random(5);
    PointCloud points = sphere(5000, random);
    for (const Point3& p : sphere(300, random)) points.push_back({5.0 + 0.2 * p.x, 0.2 * p.y, 0.2 * p.z});
    EXPECT_LE(count(outliersOf(points), 5000, points.size()), 2u);
}

// `bodies` spheres on a grid, far apart, of about `size` points each (a tenth more or less).
PointCloud manyBodies(int bodies, std::size_t size, Random& random) {
    PointCloud points;
    for (int i = 0; i < bodies; ++i) {
        const Point3 centre{3.0 * (i % 10), 3.0 * (i / 10 % 10), 3.0 * (i / 100)};
        const std::size_t count = size - size / 10 + random.below(size / 5 + 1);
        for (const Point3& p : sphere(count, random)) points.push_back(centre + 0.5 * p);
    }
    return points;
}

TEST(FindOutliers, KeepsManySmallBodiesOfLikeSize) {
    Random random(7);
    for (const int bodies : {20, 60, 100, 150, 300}) {
        for (const std::size_t points : {6000u, 20000u}) {
            const std::size_t size = points / static_cast<std::size_t>(bodies);
            const PointCloud cloud = manyBodies(bodies, size, random);
            const auto found = findOutliers(cloud, NeighbourIndex(cloud), kRatio).value();
            if (size < 40) continue;
            EXPECT_LE(count(found.isOutlier, 0, cloud.size()), cloud.size() / 100) << bodies << " " << size;
            EXPECT_EQ(found.clusters, 0u) << bodies << " " << size;
        }
    }
}

TEST(FindOutliers, DropsAFewSmallBodiesBesideALargeOneAndCountsThem) {
    Random random(8);
    PointCloud points = manyBodies(3, 60, random);
    const std::size_t debris = points.size();
    for (const Point3& p : sphere(9800, random)) points.push_back(Point3{0, 0, 20} + 4.0 * p);
    const auto found = findOutliers(points, NeighbourIndex(points), kRatio).value();
    EXPECT_EQ(found.clusters, 3u);
    EXPECT_GE(count(found.isOutlier, 0, debris), debris - 2);
    EXPECT_LE(count(found.isOutlier, debris, points.size()), 5u);
}

TEST(FindOutliers, ManyScatteredClumpsOfAFewPointsAreNoBodies) {
    Random random(9);
    PointCloud points = sphere(9000, random);
    const std::size_t clean = points.size();
    for (int clump = 0; clump < 100; ++clump) {
        const Point3 centre{random.uniform(2, 6), random.uniform(2, 6), random.uniform(2, 6)};
        for (int i = 0; i < 10; ++i) {
            points.push_back(centre + 0.01 * Point3{random.normal(), random.normal(), random.normal()});
        }
    }
    const auto outliers = outliersOf(points);
    EXPECT_GE(count(outliers, clean, points.size()), 990u);
    EXPECT_LE(count(outliers, 0, clean), 5u);
}

TEST(FindOutliers, DoesNotDependOnThePose) {
    Random random(6);
    PointCloud points = sphere(3000, random);
    for (int i = 0; i < 40; ++i) {
        points.push_back({random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0)});
    }
    Motion motion;
    motion.rotation = randomRotation(random);
    motion.scale = 3.0;
    EXPECT_EQ(outliersOf(points), outliersOf(applyToCloud(motion, points)));
}

TEST(FindOutliers, FindsNoneAmongAHandfulOfPoints) {
    EXPECT_TRUE(outliersOf({}).empty());
    EXPECT_EQ(outliersOf({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 100}}), (std::vector<std::uint8_t>(4, 0)));
}

}  // namespace
}  // namespace shapedb
