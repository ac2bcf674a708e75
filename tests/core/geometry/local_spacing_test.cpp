// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include "core/base/random.h"
#include "core/delaunay/hilbert_order.h"
#include "core/geometry/neighbours.h"
#include "tests/core/geometry/random_points.h"
#include "tests/core/segmentation/small_clouds.h"

namespace shapedb {
namespace {

using testing_support::randomPoints;

// From all pairs; summed from the nearest on.
double meanOfThreeNearest(const PointCloud& points, std::size_t of) {
    std::vector<double> squared;
    for (std::size_t i = 0; i < points.size(); ++i) {
        if (i != of) squared.push_back(squaredDistance(points[i], points[of]));
    }
    squared.resize(std::max<std::size_t>(squared.size(), 3), std::numeric_limits<double>::infinity());
    std::sort(squared.begin(), squared.end());
    return (std::sqrt(squared[0]) + std::sqrt(squared[1]) + std::sqrt(squared[2])) / 3.0;
}

void expectAllPairs(const PointCloud& points, const std::string& name) {
    const auto spacings = localSpacings(points).value();
    ASSERT_EQ(spacings.size(), points.size());
    for (std::size_t p = 0; p < spacings.size(); ++p) {
        ASSERT_EQ(spacings[p], meanOfThreeNearest(points, p))
            << name << " point " << p << " of " << points.size();
    }
}

PointCloud alongCurve(const PointCloud& points) {
    PointCloud sorted;
    for (const std::uint32_t i : hilbertOrder(points)) sorted.push_back(points[i]);
    return sorted;
}

// Spacings that differ by four orders of magnitude.
PointCloud clusters(std::size_t count, std::uint64_t seed) {
    Random random(seed);
    PointCloud points = randomPoints(count, seed + 1);
    for (Point3& p : points) {
        const double scale = std::pow(10.0, -static_cast<double>(random.below(5)));
        const double shift = static_cast<double>(random.below(3));
        p = scale * p + Point3{shift, 0.0, shift};
    }
    return points;
}

TEST(LocalSpacings, AgreeWithAllPairs) {
    for (const SmallCloud& cloud : smallClouds()) {
        expectAllPairs(cloud.points, cloud.name);
        expectAllPairs(alongCurve(cloud.points), cloud.name + " along the curve");
    }
}

// So that the last leaf, pair and node are full, nearly full and nearly empty.
TEST(LocalSpacings, AgreeWithAllPairsForAnyNumberOfPoints) {
    for (std::size_t count = 0; count <= 150; ++count) {
        expectAllPairs(alongCurve(randomPoints(count, count)), "random");
    }
    for (const std::size_t count : {511U, 512U, 513U, 1025U, 4097U}) {
        expectAllPairs(alongCurve(clusters(count, count)), "clusters");
    }
}

TEST(LocalSpacings, AgreeWithAllPairsInAnyOrderAndForRepeatedPoints) {
    expectAllPairs(randomPoints(700, 5), "not along the curve");
    PointCloud repeated = randomPoints(100, 6);
    for (std::size_t i = 0; i < 200; ++i) repeated.push_back(repeated[i % 40]);
    expectAllPairs(alongCurve(repeated), "repeated");
}

TEST(LocalSpacings, AgreeWithAllPairsForUnevenClusters) {
    expectAllPairs({{0, 0, 0},
                    {0.01, 0, 0},
                    {0.02, 0.001, 0},
                    {0.03, 0, 0.001},
                    {0.9, 0.1, 0.2},
                    {0.1, 0.9, 0.3},
                    {0.2, 0.1, 0.9},
                    {-0.9, -0.8, -0.7}},
                   "a row and four far away");
}

TEST(LocalSpacings, AreTheSameForAnyNumberOfThreads) {
    const PointCloud points = alongCurve(clusters(40000, 9));
    std::vector<std::vector<double>> results;
    for (const int threads : {1, 3}) {
        tbb::task_arena arena(threads);
        results.push_back(arena.execute([&] { return localSpacings(points).value(); }));
    }
    EXPECT_EQ(results[0], results[1]);
}

TEST(LocalSpacings, CanBeCancelled) {
    const std::atomic<bool> cancel{true};
    RunContext context;
    context.cancel = &cancel;
    const auto stopped = localSpacings(randomPoints(100, 3), context);
    ASSERT_FALSE(stopped);
    EXPECT_EQ(stopped.error().code, ErrorCode::kCancelled);
}

}  // namespace
}  // namespace shapedb
