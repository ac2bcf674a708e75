// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/fit/surface_points.h"

#include <chrono>
#include <cmath>
#include <ctime>
#include <limits>
#include <vector>

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include "core/base/random.h"
#include "core/geometry/motion.h"
#include "core/synthetic/degrade.h"
#include "core/synthetic/families.h"
#include "core/synthetic/named_shapes.h"
#include "tests/core/signature/moved_scans.h"

namespace shapedb {
namespace {

PointCloud sphere(std::size_t count) { return *sampleBoundary(makeSphere().solid, count, 3); }

double nearestOther(const SurfacePoints& surface, std::size_t i, std::size_t among) {
    double nearest = INFINITY;
    for (std::size_t j = 0; j < among; ++j) {
        if (j != i) nearest = std::min(nearest, distance(surface.position(i), surface.position(j)));
    }
    return nearest;
}

TEST(SurfacePoints, AreFewAndOnTheSurface) {
    const auto surface = makeSurfacePoints(sphere(20000));
    ASSERT_TRUE(surface) << surface.error().message;
    EXPECT_LE(surface->size(), kMostSurfacePoints);
    EXPECT_GE(surface->size(), kMostSurfacePoints * 9 / 10);
    for (std::size_t i = 0; i < surface->size(); ++i) {
        EXPECT_NEAR(length(surface->position(i)), 1.0, 0.01);
    }
}

TEST(SurfacePoints, HaveNormalsAcrossTheSurface) {
    const auto surface = makeSurfacePoints(sphere(20000));
    ASSERT_TRUE(surface);
    for (std::size_t i = 0; i < surface->size(); ++i) {
        EXPECT_NEAR(length(surface->normal(i)), 1.0, 1e-12);
        EXPECT_GT(std::abs(dot(surface->normal(i), surface->position(i))), 0.96);
    }
}

TEST(SurfacePoints, AreEvenSetsInEveryPrefix) {
    const auto surface = makeSurfacePoints(sphere(20000));
    ASSERT_TRUE(surface);
    // Circles around n points cover a sphere of area 4 pi when they reach about sqrt(4 pi / n).
    for (const std::size_t n : {16u, 64u, 256u, 1024u}) {
        const double fair = std::sqrt(4.0 * 3.14159 / static_cast<double>(n));
        for (std::size_t i = 0; i < n; ++i) EXPECT_GT(nearestOther(*surface, i, n), 0.55 * fair) << n;
    }
}

TEST(SurfacePoints, DoNotDependOnTheOrderOfTheScan) {
    const auto member = makeMember("animal", 1, 1);
    ASSERT_TRUE(member);
    const auto scan = scanOf(*member, {});
    ASSERT_TRUE(scan);
    const auto surface = makeSurfacePoints(*scan);
    const auto again = makeSurfacePoints(testing_support::shuffled(*scan, 9));
    ASSERT_TRUE(surface && again);
    EXPECT_EQ(surface->points, again->points);
    EXPECT_EQ(surface->centre, again->centre);
    EXPECT_EQ(surface->unit, again->unit);
}

TEST(SurfacePoints, LeaveOutSmallClustersFarOff) {
    PointCloud scan = sphere(20000);
    Random random(4);
    for (int i = 0; i < 200; ++i) {
        scan.push_back(Point3{6.0, 1.0, 0.0} + 0.05 * randomDirection(random));
    }
    scan.push_back({-9.0, 0.0, 0.0});
    const auto surface = makeSurfacePoints(scan);
    ASSERT_TRUE(surface);
    EXPECT_GE(surface->size(), kMostSurfacePoints * 9 / 10);
    for (std::size_t i = 0; i < surface->size(); ++i) EXPECT_LT(length(surface->position(i)), 1.1);
}

TEST(SurfacePoints, KeepLargeSeparateParts) {
    PointCloud scan = sphere(5000);
    for (const Point3& p : sphere(1000)) scan.push_back(Point3{6.0, 0.0, 0.0} + 0.4 * p);
    const auto surface = makeSurfacePoints(scan);
    ASSERT_TRUE(surface);
    EXPECT_NEAR(surface->centre.x, 2.7, 0.05);
}

TEST(SurfacePoints, OfASmallScanAreItsPoints) {
    const PointCloud scan = {{0, 0, 0}, {1, 0, 0}, {0, 2, 0}, {0, 0, 3}, {1, 1, 1}, {0, 0, 0}};
    const auto surface = makeSurfacePoints(scan);
    ASSERT_TRUE(surface) << surface.error().message;
    ASSERT_EQ(surface->size(), 5u);
    for (std::size_t i = 0; i < surface->size(); ++i) {
        double nearest = INFINITY;
        for (const Point3& p : scan) nearest = std::min(nearest, distance(p, surface->position(i)));
        EXPECT_LT(nearest, 1e-4);
    }
}

TEST(SurfacePoints, OfAScanInAPlaneStandAcrossIt) {
    PointCloud scan;
    Random random(2);
    for (int i = 0; i < 3000; ++i) scan.push_back({random.uniform(), random.uniform(), 5.0});
    const auto surface = makeSurfacePoints(scan);
    ASSERT_TRUE(surface) << surface.error().message;
    for (std::size_t i = 0; i < surface->size(); ++i) EXPECT_NEAR(surface->normal(i).z, 1.0, 1e-9);
}

TEST(SurfacePoints, RefuseWhatHasNoSurface) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const auto codeOf = [](const PointCloud& scan) { return makeSurfacePoints(scan).error().code; };
    EXPECT_EQ(codeOf({}), ErrorCode::kTooFewPoints);
    EXPECT_EQ(codeOf({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}}), ErrorCode::kTooFewPoints);
    EXPECT_EQ(codeOf({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 1, 0}}), ErrorCode::kTooFewPoints);
    EXPECT_EQ(codeOf(PointCloud(10, Point3{1, 2, 3})), ErrorCode::kAllPointsEqual);
    EXPECT_EQ(codeOf({{0, 0, 0}, {1, 0, 0}, {0, nan, 0}, {0, 0, 1}}), ErrorCode::kNonFiniteCoordinate);
    EXPECT_EQ(codeOf({{0, 0, 0}, {1e39, 0, 0}, {0, 1, 0}, {0, 0, 1}}), ErrorCode::kCoordinateOutOfRange);
    PointCloud line;
    for (int i = 0; i < 100; ++i) line.push_back({0.1 * i, 0.2 * i, -0.3 * i});
    EXPECT_EQ(codeOf(line), ErrorCode::kCollinear);
}

TEST(SurfacePoints, HandleHugeAndTinyScans) {
    for (const double scale : {1e-37, 1.0, 1e38}) {
        PointCloud scan;
        for (const Point3& p : sphere(2000)) scan.push_back(scale * p);
        const auto surface = makeSurfacePoints(scan);
        ASSERT_TRUE(surface) << surface.error().message;
        EXPECT_NEAR(surface->unit / scale, 1.0, 0.02);
    }
}

TEST(SurfacePoints, StopWhenAsked) {
    const std::atomic<bool> cancel{true};
    RunContext context;
    context.cancel = &cancel;
    EXPECT_EQ(makeSurfacePoints(sphere(100), context).error().code, ErrorCode::kCancelled);
}

TEST(SurfacePoints, PackNormalsToHalfADegree) {
    Random random(5);
    for (int i = 0; i < 2000; ++i) {
        const Point3 n = randomDirection(random);
        EXPECT_GT(std::abs(dot(n, unpackNormal(packNormal(n)))), std::cos(0.0125));
        EXPECT_EQ(packNormal(n), packNormal(-1.0 * n));
    }
    for (const Point3& n : {Point3{1, 0, 0}, Point3{0, 1, 0}, Point3{0, 0, 1}, Point3{0, 0, -1}}) {
        EXPECT_NEAR(std::abs(dot(n, unpackNormal(packNormal(n)))), 1.0, 1e-12);
    }
}

// Time of this thread, in which a machine under load does not count.
double processorSeconds() {
    timespec now{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

TEST(SurfacePoints, OfALargeScanEndSoonAfterTheDeadline) {
    Random random(5);
    PointCloud scan;
    for (int i = 0; i < 2'000'000; ++i) {
        scan.push_back({random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0), random.uniform(-1.0, 1.0)});
    }
    const auto timed = [&](const RunContext& context, ErrorCode expected) {
        const double began = processorSeconds();
        const auto surface = makeSurfacePoints(scan, context);
        EXPECT_EQ(surface ? ErrorCode::kInternal : surface.error().code, expected);
        return processorSeconds() - began;
    };
    // All of the work in this thread.
    tbb::task_arena(1).execute([&] {
        const double whole = timed({}, ErrorCode::kInternal);
        for (const double share : {0.1, 0.3, 0.5, 0.7}) {
            RunContext context;
            const std::chrono::duration<double> allowed(share * whole);
            context.deadline =
                RunContext::Clock::now() + std::chrono::duration_cast<RunContext::Clock::duration>(allowed);
            const double late = timed(context, ErrorCode::kDeadlineExceeded) - allowed.count();
            EXPECT_LT(late, 0.1 * whole) << share << " of " << whole << " s";
        }
    });
}

}  // namespace
}  // namespace shapedb
