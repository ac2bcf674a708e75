// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/preparation/decimate.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <map>

#include <gtest/gtest.h>

#include "core/base/random.h"
#include "core/preparation/sanitise.h"
#include "core/synthetic/named_shapes.h"

namespace shapedb {
namespace {

PointCloud surface(const NamedShape& shape, std::size_t count) {
    return sanitise(sampleBoundary(shape.solid, count, 2).value()).value().points;
}

PointCloud filled(std::size_t count) {
    Random random(8);
    PointCloud points;
    for (std::size_t i = 0; i < count; ++i) {
        points.push_back({random.uniform(-1, 1), random.uniform(-1, 1), random.uniform(-1, 1)});
    }
    return points;
}

TEST(Decimate, MeetsTheTargetAtAnyDensity) {
    const PointCloud clouds[] = {surface(makeDumbbell(), 40000), surface(makeBox(), 40000), filled(40000)};
    int close = 0;
    int all = 0;
    for (const PointCloud& points : clouds) {
        for (const std::size_t target : {50, 200, 1000, 5000, 20000, 39000}) {
            const auto decimated = decimate(points, target);
            ASSERT_TRUE(decimated);
            EXPECT_LE(decimated->points.size(), target);
            EXPECT_GE(decimated->points.size(), target / 2) << target;
            close += decimated->points.size() >= 0.9 * static_cast<double>(target);
            ++all;
        }
    }
    EXPECT_GE(close, all * 8 / 10) << "of " << all;
}

// Where nearly every point has a cell of its own, the count hardly depends on the cell size.
TEST(Decimate, MeetsATargetJustBelowTheNumberOfPoints) {
    for (const std::size_t count : {1000, 40000}) {
        const PointCloud points = filled(count);
        const auto decimated = decimate(points, count - 1);
        ASSERT_TRUE(decimated);
        EXPECT_LT(decimated->points.size(), count);
        EXPECT_GE(decimated->points.size(), count * 9 / 10);
    }
}

TEST(Decimate, PointsAreTheMeansOfTheirCells) {
    const PointCloud points = surface(makeLShape(), 20000);
    const auto decimated = decimate(points, 1500).value();
    ASSERT_EQ(decimated.siteOfPoint.size(), points.size());
    EXPECT_GT(decimated.cellSize, 0.0);
    std::vector<Point3> sums(decimated.points.size());
    std::vector<double> counts(decimated.points.size(), 0.0);
    std::map<std::array<long, 3>, std::uint32_t> siteOfCell;
    for (std::size_t i = 0; i < points.size(); ++i) {
        const std::uint32_t site = decimated.siteOfPoint[i];
        ASSERT_LT(site, decimated.points.size());
        sums[site] = sums[site] + points[i];
        counts[site] += 1.0;
        const auto index = [&](double v) {
            return static_cast<long>(std::floor((v + 1.0) / decimated.cellSize));
        };
        const auto known = siteOfCell.emplace(
            std::array<long, 3>{index(points[i].x), index(points[i].y), index(points[i].z)}, site);
        ASSERT_EQ(known.first->second, site) << "a cell has one mean";
    }
    EXPECT_EQ(siteOfCell.size(), decimated.points.size());
    for (std::size_t s = 0; s < sums.size(); ++s) {
        ASSERT_GT(counts[s], 0.0);
        ASSERT_LT(distance((1.0 / counts[s]) * sums[s], decimated.points[s]), 1e-13);
    }
    EXPECT_TRUE(std::is_sorted(decimated.points.begin(), decimated.points.end(), lexicographicLess));
}

TEST(Decimate, IsDeterministicAndHardlyDependsOnOrder) {
    const PointCloud points = surface(makeJack(), 10000);
    const auto a = decimate(points, 2000).value();
    const auto b = decimate(points, 2000).value();
    EXPECT_TRUE(a.points == b.points);
    EXPECT_EQ(a.siteOfPoint, b.siteOfPoint);
    // In another order, only the rounding of the sums differs.
    const PointCloud reversed(points.rbegin(), points.rend());
    const auto c = decimate(reversed, 2000).value();
    ASSERT_EQ(c.points.size(), a.points.size());
    EXPECT_EQ(c.cellSize, a.cellSize);
    for (std::size_t i = 0; i < points.size(); ++i) {
        ASSERT_LT(distance(c.points[c.siteOfPoint[points.size() - 1 - i]], a.points[a.siteOfPoint[i]]),
                  1e-13);
    }
}

TEST(Decimate, LeavesSmallScansAlone) {
    PointCloud points = filled(100);
    points.push_back(points[3]);
    const auto same = decimate(points, 101).value();
    EXPECT_EQ(same.points.size(), 100U);
    EXPECT_EQ(same.cellSize, 0.0);
    for (std::size_t i = 0; i < points.size(); ++i) EXPECT_EQ(same.points[same.siteOfPoint[i]], points[i]);
}

TEST(Decimate, HandlesTinyTargetsAndCorners) {
    // All corners of the frame, including the far one, can share a cell.
    PointCloud corners;
    for (const double x : {-1.0, 1.0}) {
        for (const double y : {-1.0, 1.0}) {
            for (const double z : {-1.0, 1.0}) corners.push_back({x, y, z});
        }
    }
    for (const std::size_t target : {4, 5, 7}) {
        const auto decimated = decimate(corners, target);
        ASSERT_TRUE(decimated);
        EXPECT_LE(decimated->points.size(), target);
        EXPECT_GE(decimated->points.size(), 1U);
    }
    // Clusters finer than the finest cell.
    PointCloud clusters;
    for (int i = 0; i < 1000; ++i) clusters.push_back({i % 2 == 0 ? -0.5 : 0.5, 1e-9 * i, 0.0});
    EXPECT_LE(decimate(clusters, 10)->points.size(), 10U);
}

TEST(Decimate, RefusesBadTargetsAndCanBeCancelled) {
    for (const std::size_t target : {0, 1, 3}) {
        EXPECT_EQ(decimate(filled(10), target).error().code, ErrorCode::kInvalidArgument);
    }
    const std::atomic<bool> cancel{true};
    RunContext context;
    context.cancel = &cancel;
    EXPECT_EQ(decimate(filled(1000), 100, context).error().code, ErrorCode::kCancelled);
    RunContext late;
    late.deadline = RunContext::Clock::now();
    EXPECT_EQ(decimate(filled(1000), 100, late).error().code, ErrorCode::kDeadlineExceeded);
}

}  // namespace
}  // namespace shapedb
