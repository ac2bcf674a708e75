// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/synthetic/degrade.h"

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/base/random.h"
#include "core/synthetic/named_shapes.h"
#include "tests/core/geometry/random_points.h"

namespace shapedb {

namespace {

PointCloud randomPoints(std::size_t count, std::uint64_t seed) {
    return testing_support::randomPoints(count, seed, {-1, 2, 0}, {5, 3, 1});
}

TEST(Noise, SigmaIsTheShareOfTheDiagonalOnEveryAxis) {
    // Box 3 x 4 x 12: diagonal 13.
    PointCloud points(100000, Point3{1.0, 1.0, 1.0});
    points[0] = {0, 0, 0};
    points[1] = {3, 4, 12};
    const PointCloud before = points;
    ASSERT_TRUE(addGaussianNoise(points, 0.01, 5));
    Point3 squares;
    Point3 sum;
    double xy = 0.0;
    for (std::size_t i = 0; i < points.size(); ++i) {
        const Point3 d = points[i] - before[i];
        sum = sum + d;
        squares = squares + Point3{d.x * d.x, d.y * d.y, d.z * d.z};
        xy += d.x * d.y;
    }
    const double n = static_cast<double>(points.size());
    const double sigma = 0.13;
    for (const double s : {squares.x, squares.y, squares.z})
        EXPECT_NEAR(std::sqrt(s / n), sigma, 0.01 * sigma);
    for (const double s : {sum.x, sum.y, sum.z}) EXPECT_NEAR(s / n, 0.0, 5.0 * sigma / std::sqrt(n));
    EXPECT_NEAR(xy / n, 0.0, 5.0 * sigma * sigma / std::sqrt(n));
}

TEST(Noise, OfZeroChangesNoBit) {
    PointCloud points = randomPoints(100, 1);
    points.push_back({-0.0, 1e300, 5e-324});
    const PointCloud before = points;
    ASSERT_TRUE(addGaussianNoise(points, 0.0, 1));
    EXPECT_EQ(points, before);
    EXPECT_TRUE(std::signbit(points.back().x));
}

TEST(Noise, IsReproducibleBySeed) {
    const PointCloud clean = randomPoints(100, 1);
    PointCloud a = clean;
    PointCloud b = clean;
    PointCloud c = clean;
    ASSERT_TRUE(addGaussianNoise(a, 0.01, 7));
    ASSERT_TRUE(addGaussianNoise(b, 0.01, 7));
    ASSERT_TRUE(addGaussianNoise(c, 0.01, 8));
    EXPECT_EQ(a, b);
    EXPECT_NE(a, c);
    EXPECT_NE(a, clean);
}

TEST(Noise, RefusesBadSharesAndLeavesThePointsAlone) {
    const PointCloud clean = randomPoints(10, 1);
    for (const double share :
         {-0.01, std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
        PointCloud points = clean;
        const auto done = addGaussianNoise(points, share, 1);
        ASSERT_FALSE(done) << share;
        EXPECT_EQ(done.error().code, ErrorCode::kInvalidArgument);
        EXPECT_EQ(points, clean);
    }
}

TEST(Noise, RefusesANonFinitePoint) {
    PointCloud points = randomPoints(10, 1);
    points[6].z = std::numeric_limits<double>::infinity();
    const auto done = addGaussianNoise(points, 0.01, 1);
    ASSERT_FALSE(done);
    EXPECT_EQ(done.error().code, ErrorCode::kNonFiniteCoordinate);
    EXPECT_NE(done.error().message.find("point 6"), std::string::npos);
}

TEST(Noise, HandlesHugeTinyAndEmptyClouds) {
    PointCloud huge = {{0, 0, 0}, {1e200, 1e200, 0}};
    ASSERT_TRUE(addGaussianNoise(huge, 0.01, 1));
    EXPECT_NE(huge[0].x, 0.0);
    PointCloud tiny = {{0, 0, 0}, {1e-200, 0, 0}};
    ASSERT_TRUE(addGaussianNoise(tiny, 0.01, 1));
    EXPECT_NE(tiny[0].x, 0.0);
    EXPECT_LT(std::abs(tiny[0].x), 1e-200);
    PointCloud overflow = {{-1.7e308, 0, 0}, {1.7e308, 0, 0}};
    EXPECT_EQ(addGaussianNoise(overflow, 0.5, 1).error().code, ErrorCode::kCoordinateOutOfRange);
    PointCloud empty;
    EXPECT_TRUE(addGaussianNoise(empty, 0.01, 1));
}

TEST(Subsample, KeepsOrderAndTakesNoPointTwice) {
    PointCloud points;
    for (int i = 0; i < 1000; ++i) points.push_back({static_cast<double>(i), 0, 0});
    const PointCloud some = subsample(points, 300, 4);
    ASSERT_EQ(some.size(), 300U);
    for (std::size_t i = 1; i < some.size(); ++i) EXPECT_LT(some[i - 1].x, some[i].x);
    EXPECT_EQ(some, subsample(points, 300, 4));
    EXPECT_NE(some, subsample(points, 300, 5));
}

TEST(Subsample, ReturnsAllWhenThereAreNoMore) {
    const PointCloud points = randomPoints(20, 1);
    EXPECT_EQ(subsample(points, 20, 1), points);
    EXPECT_EQ(subsample(points, 2000, 1), points);
    EXPECT_TRUE(subsample(points, 0, 1).empty());
    EXPECT_TRUE(subsample({}, 5, 1).empty());
}

// All ten 2-subsets of five points are equally frequent (chi-square, 9 degrees of freedom, 0.1 % level).
TEST(Subsample, MakesAllSubsetsEquallyLikely) {
    PointCloud points;
    for (int i = 0; i < 5; ++i) points.push_back({static_cast<double>(i), 0, 0});
    std::vector<int> seen(25, 0);
    constexpr int kDraws = 20000;
    for (int seed = 0; seed < kDraws; ++seed) {
        const PointCloud pair = subsample(points, 2, static_cast<std::uint64_t>(seed));
        ASSERT_EQ(pair.size(), 2U);
        ++seen[static_cast<std::size_t>(pair[0].x * 5 + pair[1].x)];
    }
    double chi = 0.0;
    int subsets = 0;
    for (const int n : seen) {
        if (n == 0) continue;
        ++subsets;
        chi += std::pow(n - kDraws / 10.0, 2) / (kDraws / 10.0);
    }
    EXPECT_EQ(subsets, 10);
    EXPECT_LT(chi, 27.9);
}

}  // namespace

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
