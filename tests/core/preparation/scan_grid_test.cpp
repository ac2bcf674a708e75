// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/preparation/scan_grid.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include "core/base/random.h"
#include "core/preparation/decimate.h"
#include "core/preparation/sanitise.h"
#include "core/synthetic/named_shapes.h"

namespace shapedb {
namespace {

PointCloud jack(std::size_t count) { return sampleBoundary(makeJack().solid, count, 4).value(); }

TEST(ScanGrid, PointsAreTheMeansOfTheirSites) {
    const PointCloud scan = jack(60000);
    const auto gridded = gridScan(scan, 1000).value().value();
    ASSERT_EQ(gridded.siteOfPoint.size(), scan.size());
    EXPECT_LE(gridded.points.size(), 1000U);
    EXPECT_GE(gridded.points.size(), 850U);
    EXPECT_TRUE(std::is_sorted(gridded.points.begin(), gridded.points.end(), lexicographicLess));
    std::vector<Point3> sums(gridded.points.size());
    std::vector<double> counts(gridded.points.size(), 0.0);
    for (std::size_t i = 0; i < scan.size(); ++i) {
        const std::uint32_t site = gridded.siteOfPoint[i];
        ASSERT_LT(site, sums.size());
        sums[site] = sums[site] + scan[i];
        counts[site] += 1.0;
    }
    for (std::size_t s = 0; s < sums.size(); ++s) {
        ASSERT_GT(counts[s], 0.0);
        EXPECT_LT(distance((1.0 / counts[s]) * sums[s], gridded.frame.toScan(gridded.points[s])), 1e-12);
    }
}

TEST(ScanGrid, SitesAreAsSmallAsThoseOfDecimate) {
    const PointCloud scan = jack(60000);
    const auto gridded = gridScan(scan, 1000).value().value();
    const auto clean = sanitise(scan).value();
    const auto plain = decimate(clean.points, 1000).value();
    EXPECT_EQ(gridded.frame.centre, clean.frame.centre);
    EXPECT_EQ(gridded.frame.unit, clean.frame.unit);
    EXPECT_NEAR(static_cast<double>(gridded.points.size()), static_cast<double>(plain.points.size()), 150.0);
    double worst = 0.0;
    for (std::size_t i = 0; i < scan.size(); ++i) {
        const Point3 p = clean.points[clean.siteOfPoint[i]];
        worst = std::max(worst, distance(p, gridded.points[gridded.siteOfPoint[i]]));
    }
    // The points of a site lie in one cell, or in a small cell that extends beyond it.
    EXPECT_LT(worst, 2.0 * std::sqrt(3.0) * plain.cellSize);
}

TEST(ScanGrid, DoesNotDependOnTheOrderOfThePoints) {
    const PointCloud scan = jack(50000);
    const auto a = gridScan(scan, 500).value().value();
    PointCloud turned(scan.rbegin(), scan.rend());
    const auto b = gridScan(turned, 500).value().value();
    EXPECT_TRUE(a.points == b.points);
    EXPECT_TRUE(std::equal(a.siteOfPoint.begin(), a.siteOfPoint.end(), b.siteOfPoint.rbegin()));
    // Dense parts first, so that the grid is coarsened at other times.
    std::sort(turned.begin(), turned.end(),
              [](const Point3& p, const Point3& q) { return length(p) < length(q); });
    EXPECT_TRUE(gridScan(turned, 500).value().value().points == a.points);
}

// Long enough, for the small target, to give each thread a stretch. The last stretch is dense, so that its
// grid is the coarsest.
TEST(ScanGrid, IsTheSameForAnyNumberOfThreads) {
    PointCloud scan = jack(150000);
    const PointCloud dense = sampleBoundary(makeBox().solid, 300000, 5).value();
    for (const Point3& p : dense) scan.push_back(0.3 * p);
    for (const std::size_t target : {std::size_t{500}, std::size_t{20000}}) {
        const auto in = [&](int threads) {
            tbb::task_arena arena(threads);
            return arena.execute([&] { return gridScan(scan, target).value().value(); });
        };
        const auto one = in(1);
        for (const int threads : {2, 3, 7}) {
            const auto several = in(threads);
            EXPECT_TRUE(several.points == one.points) << target << " " << threads;
            EXPECT_TRUE(several.siteOfPoint == one.siteOfPoint) << target << " " << threads;
        }
    }
}

TEST(ScanGrid, ResolvesAShapeThatIsSmallInItsFrame) {
    PointCloud scan = jack(50000);
    scan.push_back({3000.0, 2000.0, -1000.0});
    const auto gridded = gridScan(scan, 500).value().value();
    EXPECT_LE(gridded.points.size(), 500U);
    EXPECT_GE(gridded.points.size(), 400U);
}

TEST(ScanGrid, LeavesScansWithFewDistinctPointsToSanitise) {
    PointCloud scan;
    for (int i = 0; i < 50000; ++i) {
        scan.push_back({(i % 5) * 1.0, (i / 5 % 5) * 1.0, (i / 25 % 5) * 1.0});
    }
    EXPECT_FALSE(gridScan(scan, 500).value().has_value());
}

TEST(ScanGrid, RefusesBadScans) {
    PointCloud scan = jack(20000);
    PointCloud flat = scan;
    for (Point3& p : flat) p.z = 1.0;
    EXPECT_EQ(gridScan(flat, 500).error().code, ErrorCode::kCoplanar);
    scan[777].y = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(gridScan(scan, 500).error().code, ErrorCode::kNonFiniteCoordinate);
    EXPECT_NE(gridScan(scan, 500).error().message.find("777"), std::string::npos);
    EXPECT_EQ(gridScan({}, 500).error().code, ErrorCode::kTooFewPoints);
    EXPECT_EQ(gridScan(PointCloud(9000), 500).error().code, ErrorCode::kAllPointsEqual);
}

TEST(ScanGrid, CanBeCancelled) {
    const std::atomic<bool> cancel{true};
    RunContext context;
    context.cancel = &cancel;
    EXPECT_EQ(gridScan(jack(20000), 500, context).error().code, ErrorCode::kCancelled);
}

}  // namespace
}  // namespace shapedb
