// SPDX-License-Identifier: GPL-3.0-or-later
// Every way a scan can be unusable; and how running work is cancelled and observed.
#include <atomic>
#include <chrono>
#include <cmath>
#include <limits>
#include <map>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <pthread.h>
#include <time.h>

#include "core/base/random.h"
#include "core/geometry/motion.h"
#include "core/segmentation/segmentation.h"
#include "core/synthetic/named_shapes.h"

namespace shapedb {
namespace {

using Clock = RunContext::Clock;

PointCloud dumbbell(std::size_t count) { return sampleBoundary(makeDumbbell().solid, count, 1).value(); }

double secondsSince(Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
}

void expectError(const PointCloud& points, ErrorCode code, const std::vector<std::string>& words = {}) {
    const auto result = segment(points, {});
    ASSERT_FALSE(result);
    EXPECT_EQ(result.error().code, code) << result.error().message;
    for (const std::string& word : words) {
        EXPECT_NE(result.error().message.find(word), std::string::npos) << result.error().message;
    }
}

TEST(BadInput, NamesNonFiniteCoordinates) {
    PointCloud points = dumbbell(500);
    points[77].y = std::nan("");
    expectError(points, ErrorCode::kNonFiniteCoordinate, {"y", "77", "NaN"});
    points = dumbbell(500);
    points[499].z = -std::numeric_limits<double>::infinity();
    expectError(points, ErrorCode::kNonFiniteCoordinate, {"z", "499", "infinite"});
}

TEST(BadInput, RefusesTooFewPoints) {
    PointCloud points;
    for (int i = 0; i < 4; ++i) {
        expectError(points, ErrorCode::kTooFewPoints, {std::to_string(i)});
        points.push_back({i * 1.0, i * i * 1.0, i * i * i * 1.0});
    }
    expectError({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 1, 0}, {1, 0, 0}}, ErrorCode::kTooFewPoints,
                {"3 of 5"});
}

TEST(BadInput, RefusesAMillionCopiesOfOnePointAtOnce) {
    const auto start = Clock::now();
    expectError(PointCloud(1000000, Point3{0.1, -7.0, 3e5}), ErrorCode::kAllPointsEqual, {"1000000"});
    EXPECT_LT(secondsSince(start), 20.0);
}

TEST(BadInput, AMillionCopiesDoNotHideTheShape) {
    PointCloud points = dumbbell(2000);
    points.insert(points.end(), 1000000, points[5]);
    const auto result = segment(points, {});
    ASSERT_TRUE(result);
    EXPECT_EQ(result->duplicates, 1000000U);
    EXPECT_EQ(result->sites.size(), 2000U);
    EXPECT_EQ(result->pointSegment.back(), result->pointSegment[5]);
}

TEST(BadInput, RefusesPointsOnALine) {
    Random random(2);
    const Point3 direction{0.3, -0.7, 0.2};
    for (const double scale : {1e-6, 1.0, 1e6}) {
        PointCloud axis;
        PointCloud slanted;
        PointCloud rounded;
        for (int i = 0; i < 300; ++i) {
            const double t = scale * random.uniform(-1, 1);
            axis.push_back({t, 0, 0});
            slanted.push_back(t * direction);
            rounded.push_back({static_cast<float>(t * direction.x), static_cast<float>(t * direction.y),
                               static_cast<float>(t * direction.z)});
        }
        expectError(axis, ErrorCode::kCollinear);
        expectError(slanted, ErrorCode::kCollinear);
        expectError(rounded, ErrorCode::kCollinear);
    }
}

TEST(BadInput, RefusesPointsInAPlane) {
    Random random(3);
    for (int turn = 0; turn < 5; ++turn) {
        const Matrix3 rotation = turn == 0 ? Motion{}.rotation : randomRotation(random);
        PointCloud plane;
        PointCloud rounded;
        for (int i = 0; i < 500; ++i) {
            const Point3 p = rotate(rotation, {random.uniform(-1, 1), random.uniform(-1, 1), 0.0});
            plane.push_back(p);
            rounded.push_back({static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)});
        }
        expectError(plane, ErrorCode::kCoplanar);
        expectError(rounded, ErrorCode::kCoplanar);
    }
}

TEST(BadInput, RefusesMagnitudesBeyondSinglePrecision) {
    PointCloud points = dumbbell(500);
    points[3].x = 1e300;
    expectError(points, ErrorCode::kCoordinateOutOfRange, {"x", "3"});
    points = dumbbell(500);
    for (Point3& p : points) p = 1e-300 * p;
    expectError(points, ErrorCode::kCoordinateOutOfRange, {"smaller"});
}

TEST(BadInput, AcceptsTinyDifferencesWithinAShape) {
    // Coordinates of 1e-200 beside ones of 1 must not overflow a circumcentre.
    PointCloud points;
    for (const double z : {-1.0, 1.0}) {
        for (int i = 0; i < 12; ++i) points.push_back({std::cos(i * 0.5236), std::sin(i * 0.5236), z});
    }
    Random random(1);
    for (int i = 0; i < 12; ++i) {
        points.push_back({std::cos(i * 0.5236), std::sin(i * 0.5236), random.uniform(-1e-200, 1e-200)});
    }
    const auto result = segment(points, {});
    if (result) {
        for (const double radius : result->tetrahedra.circumradii) EXPECT_TRUE(std::isfinite(radius));
    } else {
        EXPECT_EQ(result.error().code, ErrorCode::kNoInterior) << result.error().message;
    }
}

TEST(BadInput, MergesAndCountsDuplicates) {
    const PointCloud once = dumbbell(1500);
    PointCloud thrice = once;
    thrice.insert(thrice.end(), once.rbegin(), once.rend());
    thrice.insert(thrice.end(), once.begin(), once.end());
    const auto a = segment(once, {});
    const auto b = segment(thrice, {});
    ASSERT_TRUE(a && b);
    EXPECT_EQ(a->duplicates, 0U);
    EXPECT_EQ(b->duplicates, 3000U);
    EXPECT_EQ(a->volume, b->volume);
    for (std::size_t i = 0; i < once.size(); ++i) {
        ASSERT_EQ(b->pointSegment[i], a->pointSegment[i]);
        ASSERT_EQ(b->pointSegment[2999 - i], a->pointSegment[i]);
    }
}

TEST(BadInput, RefusesOptionsOutOfRange) {
    SegmentationOptions options;
    options.deepAngleDegrees = 0.0;
    EXPECT_EQ(segment(dumbbell(500), options).error().code, ErrorCode::kInvalidArgument);
}

TEST(BadInput, OpenSheetsAreRefusedOrLeaveSliversOnly) {
    Random random(5);
    PointCloud sheet;
    PointCloud noisyPlane;
    for (int i = 0; i < 4000; ++i) {
        const double x = random.uniform(-1, 1);
        const double y = random.uniform(-1, 1);
        sheet.push_back({x, y, 0.05 * std::sin(3 * x) * std::cos(2 * y)});
        noisyPlane.push_back({x, y, 1e-4 * random.normal()});
    }
    for (const PointCloud* open : {&sheet, &noisyPlane}) {
        const auto result = segment(*open, {});
        if (result) {
            EXPECT_LT(result->volume, 1e-5 * std::pow(result->size, 3.0));
        } else {
            EXPECT_EQ(result.error().code, ErrorCode::kNoInterior) << result.error().message;
        }
    }
}

// A bowl is not refused: the balls behind its opening are no larger than the opening, so nothing tells it
// from a closed surface, and its hull closes it.
TEST(BadInput, AHemisphereIsClosedByItsHull) {
    Random random(5);
    PointCloud bowl;
    for (int i = 0; i < 4000; ++i) {
        const Point3 d{random.normal(), random.normal(), std::abs(random.normal())};
        bowl.push_back((1.0 / length(d)) * d);
    }
    const auto result = segment(bowl, {});
    ASSERT_TRUE(result);
    EXPECT_NEAR(result->volume, 2.0943951, 0.02 * 2.0943951);
}

TEST(BadInput, HasNoInteriorWithoutBigBalls) {
    SegmentationOptions options;
    options.bigBallRatio = 1e6;
    const auto result = segment(dumbbell(500), options);
    ASSERT_FALSE(result);
    EXPECT_EQ(result.error().code, ErrorCode::kNoInterior);
    EXPECT_NE(result.error().message.find("big_ball_ratio"), std::string::npos) << "says what to do";
}

// Cancels as each stage begins, and in the middle of the triangulation.
TEST(RunControl, CanBeCancelledInEachStage) {
    const PointCloud points = dumbbell(20000);
    SegmentationOptions options;
    options.preparation.decimateTo = 15000;
    for (const std::string stop : {"sanitise", "decimate", "delaunay", "point_scale", "interior", "flow",
                                   "segments", "merge", "describe"}) {
        std::atomic<bool> cancel{false};
        RunContext context;
        context.cancel = &cancel;
        std::string last;
        context.progress = [&](const char* stage, std::uint64_t, std::uint64_t) {
            last = stage;
            if (stage == stop) cancel = true;
        };
        const auto result = segment(points, options, context);
        ASSERT_FALSE(result) << stop;
        EXPECT_EQ(result.error().code, ErrorCode::kCancelled) << stop;
        EXPECT_EQ(last, stop) << "nothing runs after the stage that was cancelled";
    }
}

/// Processor time that a thread has taken: the load of the machine does not change it.
double processorSeconds(clockid_t thread) {
    timespec time{};
    clock_gettime(thread, &time);
    return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

// Measured against the whole run, so that slow machines pass too: of 1.3 s it stops within some 0.1 s, which
// is a convex hull that cannot be interrupted.
TEST(RunControl, StopsPromptlyWhenAnotherThreadCancels) {
    const PointCloud points = dumbbell(100000);
    clockid_t here{};
    ASSERT_EQ(pthread_getcpuclockid(pthread_self(), &here), 0);
    const double began = processorSeconds(here);
    ASSERT_TRUE(segment(points, {}));
    const double whole = processorSeconds(here) - began;
    for (const double share : {0.1, 0.3, 0.5, 0.7, 0.85}) {
        std::atomic<bool> cancel{false};
        std::atomic<double> cancelledAt{0.0};
        const double until = processorSeconds(here) + share * whole;
        std::thread other([&] {
            while (processorSeconds(here) < until) std::this_thread::sleep_for(std::chrono::milliseconds(1));
            cancelledAt = processorSeconds(here);
            cancel = true;
        });
        RunContext context;
        context.cancel = &cancel;
        const auto result = segment(points, {}, context);
        const double returned = processorSeconds(here);
        // It spends the rest of the time here, should the run have ended before.
        while (!cancel) std::this_thread::yield();
        other.join();
        ASSERT_FALSE(result) << share;
        EXPECT_EQ(result.error().code, ErrorCode::kCancelled);
        EXPECT_LT(returned - cancelledAt, whole / 5) << "cancelled at " << share << " of " << whole << " s";
    }
}

TEST(RunControl, ReportsAPassedDeadline) {
    RunContext context;
    context.deadline = Clock::now() + std::chrono::milliseconds(60);
    const auto start = Clock::now();
    const auto result = segment(dumbbell(200000), {}, context);
    ASSERT_FALSE(result);
    EXPECT_EQ(result.error().code, ErrorCode::kDeadlineExceeded);
    EXPECT_LT(secondsSince(start), 10.0);
}

TEST(RunControl, ProgressNamesEveryStage) {
    std::vector<std::string> stages;
    bool moved = false;
    RunContext context;
    context.progress = [&](const char* stage, std::uint64_t done, std::uint64_t total) {
        if (stages.empty() || stages.back() != stage) stages.push_back(stage);
        EXPECT_LE(done, total);
        moved = moved || (done > 0 && total > done);
    };
    const auto result = segment(dumbbell(10000), {}, context);
    ASSERT_TRUE(result);
    std::vector<std::string> timed;
    for (const StageTime& stage : result->stages) timed.push_back(stage.stage);
    EXPECT_EQ(stages, timed);
    EXPECT_TRUE(moved) << "the triangulation reports how far it is";
}

}  // namespace
}  // namespace shapedb
