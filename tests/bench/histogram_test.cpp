// SPDX-License-Identifier: GPL-3.0-or-later
#include "bench/histogram.h"

#include <cmath>
#include <numeric>

#include <gtest/gtest.h>

#include "core/base/random.h"
#include "core/geometry/motion.h"
#include "tests/bench/run_bench.h"

namespace shapedb::bench {

namespace {

TEST(Histogram, DistancesOfAWorkedExample) {
    const Histogram a = {0.5F, 0.0F, 0.5F};
    const Histogram b = {0.25F, 0.0F, 0.75F};
    EXPECT_DOUBLE_EQ(l1Distance(a, b), 0.5);
    EXPECT_DOUBLE_EQ(chiSquareDistance(a, b), 0.0625 / 0.75 + 0.0625 / 1.25);
}

TEST(Histogram, DistancesAreSymmetricAndZeroForTheSame) {
    const Histogram a = {0.1F, 0.2F, 0.0F, 0.7F};
    const Histogram b = {0.3F, 0.0F, 0.0F, 0.7F};
    for (const auto distance : {l1Distance, chiSquareDistance}) {
        EXPECT_EQ(distance(a, a), 0.0);
        EXPECT_EQ(distance(a, b), distance(b, a));
        EXPECT_GT(distance(a, b), 0.0);
    }
}

TEST(Histogram, WithNothingInCommonChiSquareIsTheSumOfBoth) {
    EXPECT_DOUBLE_EQ(chiSquareDistance({1.0F, 0.0F}, {0.0F, 1.0F}), 2.0);
    EXPECT_DOUBLE_EQ(l1Distance({1.0F, 0.0F}, {0.0F, 1.0F}), 2.0);
}

}  // namespace

namespace {

double total(const Histogram& histogram) { return std::accumulate(histogram.begin(), histogram.end(), 0.0); }

Histogram d2(const PointCloud& points, std::uint64_t seed = 1, const D2Options& options = {}) {
    const auto histogram = d2Histogram(points, seed, options);
    EXPECT_TRUE(histogram);
    return histogram ? *histogram : Histogram();
}

TEST(D2Histogram, SharesAddUpToOne) {
    const Histogram histogram = d2(boxPoints(1.0, 0.5, 0.2, 500, 3));
    ASSERT_EQ(histogram.size(), D2Options{}.bins);
    EXPECT_NEAR(total(histogram), 1.0, 1e-3);
    for (const float share : histogram) EXPECT_GE(share, 0.0F);
}

TEST(D2Histogram, NeitherPoseNorSizeMatters) {
    const PointCloud points = boxPoints(1.0, 0.5, 0.2, 500, 3);
    Random random(5);
    Motion motion;
    motion.rotation = randomRotation(random);
    motion.scale = 37.0;
    motion.translation = {4.0, -100.0, 3.0};
    EXPECT_LT(l1Distance(d2(points), d2(applyToCloud(motion, points))), 1e-3);
}

TEST(D2Histogram, OfASphereIsLinearInDistance) {
    // Chords of a unit sphere have the density d / 2 on [0, 2], mean 4/3.
    Random random(7);
    PointCloud points;
    for (int i = 0; i < 20000; ++i) {
        const Point3 p{random.normal(), random.normal(), random.normal()};
        points.push_back((1.0 / length(p)) * p);
    }
    D2Options options;
    options.pairs = 400000;
    options.bins = 12;  // of width 1/4 mean distance: 1/3
    options.range = 3.0;
    const Histogram histogram = d2(points, 1, options);
    for (std::size_t bin = 0; bin < 6; ++bin) {
        const double low = static_cast<double>(bin) / 3.0;
        const double high = low + 1.0 / 3.0;
        EXPECT_NEAR(histogram[bin], 0.25 * (high * high - low * low), 0.006) << bin;
    }
    for (std::size_t bin = 7; bin < 12; ++bin) EXPECT_EQ(histogram[bin], 0.0F);
}

TEST(D2Histogram, LongDistancesAreCountedInTheLastBin) {
    PointCloud points(100, Point3{0.0, 0.0, 0.0});
    points.push_back({1.0, 0.0, 0.0});  // far more than three mean distances away
    const Histogram histogram = d2(points);
    EXPECT_NEAR(histogram.back(), 2.0 * 100.0 / (101.0 * 101.0), 0.002);
    EXPECT_NEAR(histogram.front() + histogram.back(), 1.0, 1e-3);
}

TEST(D2Histogram, SameSeedSameBits) {
    const PointCloud points = boxPoints(1.0, 0.5, 0.2, 500, 3);
    EXPECT_EQ(d2(points, 4), d2(points, 4));
    EXPECT_NE(d2(points, 4), d2(points, 5));
}

TEST(D2Histogram, TellsShapesApart) {
    const Histogram cube = d2(boxPoints(1.0, 1.0, 1.0, 2000, 1));
    const Histogram otherCube = d2(boxPoints(2.0, 2.0, 2.0, 2000, 2));
    const Histogram rod = d2(boxPoints(1.0, 0.2, 0.2, 2000, 3));
    EXPECT_LT(3.0 * l1Distance(cube, otherCube), l1Distance(cube, rod));
}

TEST(D2Histogram, RefusesCloudsWithoutDistances) {
    EXPECT_EQ(d2Histogram({}, 1).error().code, ErrorCode::kTooFewPoints);
    EXPECT_EQ(d2Histogram(PointCloud(50, Point3{1.0, 2.0, 3.0}), 1).error().code, ErrorCode::kAllPointsEqual);
    D2Options options;
    options.bins = 0;
    EXPECT_EQ(d2Histogram(boxPoints(1, 1, 1, 9, 1), 1, options).error().code, ErrorCode::kInvalidArgument);
}

}  // namespace

}  // namespace shapedb::bench
