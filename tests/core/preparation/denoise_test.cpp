// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/preparation/denoise.h"

#include <atomic>
#include <cmath>

#include <gtest/gtest.h>

#include "core/base/math.h"
#include "core/base/random.h"
#include "core/geometry/motion.h"

namespace shapedb {
namespace {

constexpr std::size_t kPoints = 8000;

// Uniform on the unit sphere, moved along the radius by Gaussian noise.
PointCloud noisySphere(double sigma) {
    Random random(5);
    PointCloud points;
    while (points.size() < kPoints) {
        const Point3 d{random.normal(), random.normal(), random.normal()};
        points.push_back(((1.0 + sigma * random.normal()) / length(d)) * d);
    }
    return points;
}

double sphereSpacing() { return std::sqrt(4.0 * kPi / static_cast<double>(kPoints)); }

double radialError(const PointCloud& points) {
    double sum = 0.0;
    for (const Point3& p : points) sum += (length(p) - 1.0) * (length(p) - 1.0);
    return std::sqrt(sum / static_cast<double>(points.size()));
}

NoiseEstimate estimateOf(const PointCloud& points) {
    return estimateNoise(points, NeighbourIndex(points), points.size() / 2);
}

TEST(EstimateNoise, FindsTheNoiseThatWasAdded) {
    for (const double sigma : {0.02, 0.04, 0.08}) {
        const NoiseEstimate estimate = estimateOf(noisySphere(sigma));
        EXPECT_NEAR(estimate.sigma / sigma, 1.0, 0.15) << sigma;
        EXPECT_NEAR(estimate.spacing / sphereSpacing(), 1.0, 0.2) << sigma;
    }
}

TEST(EstimateNoise, CallsACleanSurfaceClean) {
    const NoiseEstimate estimate = estimateOf(noisySphere(0.0));
    EXPECT_LT(estimate.sigma, 0.1 * estimate.spacing);
    EXPECT_GT(estimate.spacing, 0.65 * sphereSpacing());
    EXPECT_LT(estimate.spacing, sphereSpacing());
}

TEST(EstimateNoise, DoesNotTakeTheFarSideOfAThinPlateForNoise) {
    Random random(8);
    PointCloud plate;  // two faces, 0.06 apart, noise 0.004
    for (int i = 0; i < 20000; ++i) {
        const double z = (i % 2 == 0 ? 0.03 : -0.03) + 0.004 * random.normal();
        plate.push_back({random.uniform(), random.uniform(), z});
    }
    EXPECT_NEAR(estimateOf(plate).sigma, 0.004, 0.0015);
}

TEST(EstimateNoise, DoesNotDependOnThePose) {
    const PointCloud points = noisySphere(0.03);
    Random random(6);
    Motion motion;
    motion.rotation = randomRotation(random);
    motion.scale = 7.0;
    motion.translation = {1.0, -2.0, 3.0};
    const NoiseEstimate here = estimateOf(points);
    const NoiseEstimate there = estimateOf(applyToCloud(motion, points));
    EXPECT_NEAR(there.sigma / here.sigma, 7.0, 1e-6);
    EXPECT_NEAR(there.spacing / here.spacing, 7.0, 1e-6);
}

TEST(EstimateNoise, IsZeroForTooFewPoints) {
    EXPECT_EQ(estimateOf({}).sigma, 0.0);
    EXPECT_EQ(estimateOf({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}).sigma, 0.0);
}

TEST(Smooth, BringsPointsBackToTheirSurface) {
    for (const double sigma : {0.02, 0.05}) {
        const PointCloud points = noisySphere(sigma);
        const NeighbourIndex index(points);
        const auto moved = smooth(points, index, estimateNoise(points, index, points.size() / 2), 5.0);
        ASSERT_TRUE(moved);
        ASSERT_EQ(moved->size(), points.size());
        EXPECT_LT(radialError(*moved), 0.45 * sigma) << sigma;
        double mean = 0.0;  // nor does the sphere shrink
        for (const Point3& p : *moved) mean += length(p) / static_cast<double>(moved->size());
        EXPECT_NEAR(mean, 1.0, 0.1 * sigma) << sigma;
    }
}

TEST(Smooth, LeavesACleanScanAlone) {
    const PointCloud points = noisySphere(0.0);
    const NeighbourIndex index(points);
    const auto moved = smooth(points, index, estimateNoise(points, index, points.size() / 2), 5.0);
    ASSERT_TRUE(moved);
    EXPECT_EQ(*moved, points);
}

TEST(Smooth, MovesNoPointFartherThanThreeSigma) {
    const PointCloud points = noisySphere(0.05);
    const NeighbourIndex index(points);
    const NoiseEstimate noise = estimateNoise(points, index, points.size() / 2);
    const auto moved = smooth(points, index, noise, 5.0);
    ASSERT_TRUE(moved);
    for (std::size_t i = 0; i < points.size(); ++i) {
        ASSERT_LE(distance(points[i], (*moved)[i]), 3.0 * noise.sigma * (1.0 + 1e-9));
    }
}

TEST(Smooth, CanBeCancelled) {
    const PointCloud points = noisySphere(0.05);
    const NeighbourIndex index(points);
    const std::atomic<bool> cancel{true};
    RunContext context;
    context.cancel = &cancel;
    const auto moved = smooth(points, index, {0.05, 0.04}, 5.0, context);
    ASSERT_FALSE(moved);
    EXPECT_EQ(moved.error().code, ErrorCode::kCancelled);
}

}  // namespace
}  // namespace shapedb
