// SPDX-License-Identifier: GPL-3.0-or-later
// The adaptive interior, together with the preparation, by `segment` on solids of known volume.
#include "core/segmentation/adaptive_interior.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "core/base/math.h"
#include "core/base/random.h"
#include "core/geometry/bounding.h"
#include "core/geometry/motion.h"
#include "core/segmentation/segmentation.h"
#include "core/synthetic/degrade.h"
#include "core/synthetic/named_shapes.h"

namespace shapedb {
namespace {

SegmentationOptions adaptive() {
    SegmentationOptions options;
    options.preparation.decimateTo = 20000;
    options.preparation.outlierRatio = 3.0;
    options.preparation.smoothingReach = 5.0;
    options.preparation.thinning = 1.0;
    options.interiorMethod = InteriorMethod::kAdaptive;
    return options;
}

PointCloud sampled(const NamedShape& shape, std::size_t count = 5000) {
    const auto points = sampleBoundary(shape.solid, count, 1);
    return points ? *points : PointCloud{};
}

Segmentation found(const PointCloud& points) {
    auto result = segment(points, adaptive());
    EXPECT_TRUE(result) << (result ? "" : result.error().message);
    return result ? std::move(*result) : Segmentation{};
}

double sizeOf(const PointCloud& points) { return smallestBoxDiagonal(points).value_or(0.0); }

TEST(AdaptiveInterior, CleanSolidsKeepTheirVolumeWithHighQuality) {
    for (const NamedShape& shape : namedShapes()) {
        const PointCloud points = sampled(shape);
        const Segmentation s = found(points);
        EXPECT_NEAR(s.volume / shape.volume, 1.0, 0.03) << shape.name;
        EXPECT_NEAR(s.size / sizeOf(points), 1.0, 0.02) << shape.name;
        EXPECT_GT(s.quality, 0.9) << shape.name;
        EXPECT_EQ(s.interiorSource, InteriorSource::kWalk) << shape.name;
        EXPECT_EQ(s.pointSegment.size(), points.size());
    }
}

TEST(AdaptiveInterior, NoiseHardlyChangesVolumeAndSize) {
    for (const NamedShape& shape : namedShapes()) {
        const PointCloud clean = sampled(shape);
        for (const double noise : {0.005, 0.01}) {
            PointCloud points = clean;
            ASSERT_TRUE(addGaussianNoise(points, noise, 1));
            const Segmentation s = found(points);
            EXPECT_NEAR(s.volume / shape.volume, 1.0, 15.0 * noise) << shape.name << " " << noise;
            // Unprepared, noise of 1 % moves the box of these samples by 10 to 13 %.
            EXPECT_NEAR(s.size / sizeOf(clean), 1.0, 7.0 * noise) << shape.name << " " << noise;
            EXPECT_GT(s.noise, 0.0) << shape.name;
        }
    }
}

TEST(AdaptiveInterior, OutliersHardlyChangeTheResult) {
    for (const NamedShape& shape : namedShapes()) {
        const PointCloud clean = sampled(shape);
        PointCloud points = clean;
        Random random(9);
        for (int i = 0; i < 80; ++i) {
            points.push_back(
                {random.uniform(-4.0, 4.0), random.uniform(-4.0, 4.0), random.uniform(-4.0, 4.0)});
        }
        points.push_back({1000.0, 0.0, 0.0});
        const Segmentation s = found(points);
        EXPECT_NEAR(s.volume / shape.volume, 1.0, 0.03) << shape.name;
        EXPECT_NEAR(s.size / sizeOf(clean), 1.0, 0.03) << shape.name;
        EXPECT_GT(s.outliers, 40u) << shape.name;
        EXPECT_EQ(s.siteOfPoint.back(), kNoSite);
        EXPECT_EQ(s.pointSegment.back(), -1);
    }
}

// Without the highest fifth of the points.
PointCloud withoutCap(PointCloud points) {
    std::sort(points.begin(), points.end(), [](const Point3& a, const Point3& b) { return a.z < b.z; });
    points.resize(points.size() * 4 / 5);
    return points;
}

TEST(AdaptiveInterior, ClosesAMissingCap) {
    // A ball without the fifth of its surface above z = 0.6: the cap of height 0.4 is lost.
    const Segmentation s = found(withoutCap(sampled(makeSphere())));
    const double cap = kPi * 0.4 * 0.4 * (1.0 - 0.4 / 3.0);
    EXPECT_NEAR(s.volume / (makeSphere().volume - cap), 1.0, 0.03);
    EXPECT_GT(s.quality, 0.6);
    EXPECT_LT(s.quality, 0.95);
}

TEST(AdaptiveInterior, OpenSurfacesGetAnInteriorOfLowQuality) {
    PointCloud hemisphere;
    for (const Point3& p : sampled(makeSphere())) {
        if (p.z > 0.0) hemisphere.push_back(p);
    }
    Random random(12);
    PointCloud wave;
    PointCloud plane;
    for (int i = 0; i < 4000; ++i) {
        const double x = random.uniform(-1.0, 1.0);
        const double y = random.uniform(-1.0, 1.0);
        wave.push_back({x, y, 0.2 * std::sin(3.0 * x)});
        plane.push_back({x, y, 1e-3 * random.normal()});
    }
    EXPECT_LT(found(hemisphere).quality, 0.6);
    for (const PointCloud& sheet : {wave, plane}) {
        const auto s = segment(sheet, adaptive());
        ASSERT_TRUE(s) << s.error().message;
        EXPECT_LT(s->quality, 0.5);
        EXPECT_GT(s->volume, 0.0);
    }
}

TEST(AdaptiveInterior, RandomPointsStillHaveAnInterior) {
    Random random(22);
    PointCloud cloud;
    for (int i = 0; i < 3000; ++i) cloud.push_back({random.uniform(), random.uniform(), random.uniform()});
    const Segmentation s = found(cloud);
    EXPECT_LT(s.quality, 0.5);
    EXPECT_GT(s.volume, 0.0);
    EXPECT_LE(s.volume, 1.0);
    // From the smallest possible cloud upwards: a result or the documented error.
    for (std::size_t count = 4; count < 40; ++count) {
        const auto few = segment(
            PointCloud(cloud.begin(), cloud.begin() + static_cast<std::ptrdiff_t>(count)), adaptive());
        if (few) {
            EXPECT_GT(few->volume, 0.0) << count;
        } else {
            EXPECT_EQ(few.error().code, ErrorCode::kNoInterior) << few.error().message;
        }
    }
}

TEST(AdaptiveInterior, DoesNotBridgeTwoBarsSeenFromAbove) {
    // The upper halves of two parallel rods of radius 0.1, 0.6 apart, as a sensor above a table sees them.
    Random random(21);
    PointCloud points;
    for (int i = 0; i < 6000; ++i) {
        const double angle = random.uniform(0.0, kPi);
        const double side = i % 2 == 0 ? -0.3 : 0.3;
        points.push_back({random.uniform(-1.0, 1.0), side + 0.1 * std::cos(angle), 0.1 * std::sin(angle)});
    }
    const Segmentation s = found(points);
    const double halfRods = 2.0 * 2.0 * 0.5 * kPi * 0.01;
    EXPECT_NEAR(s.volume / halfRods, 1.0, 0.1);
    EXPECT_LT(s.quality, 0.7);
}

TEST(AdaptiveInterior, DoesNotFillAnOpenCup) {
    // Outer ball of radius 1 without its top, inner one of 0.8, and the rim between them.
    Random random(13);
    PointCloud points;
    while (points.size() < 12000) {
        const Point3 d{random.normal(), random.normal(), random.normal()};
        const Point3 u = (1.0 / length(d)) * d;
        const bool outer = random.uniform() < 0.6;
        const Point3 p = outer ? u : 0.8 * u;
        if (p.z < 0.5) points.push_back(p);
    }
    for (int i = 0; i < 600; ++i) {
        const double angle = random.uniform(0.0, 2.0 * kPi);
        const double r = random.uniform(std::sqrt(0.64 - 0.25), std::sqrt(0.75));
        points.push_back({r * std::cos(angle), r * std::sin(angle), 0.5});
    }
    // Balls cut at z = 0.5: pi h^2 (R - h / 3) with h = R + 0.5.
    const auto below = [](double r) { return kPi * (r + 0.5) * (r + 0.5) * (r - (r + 0.5) / 3.0); };
    const Segmentation s = found(points);
    EXPECT_NEAR(s.volume / (below(1.0) - below(0.8)), 1.0, 0.05);
    EXPECT_GT(s.quality, 0.8);
}

TEST(AdaptiveInterior, DoesNotDependOnOrderOrPose) {
    PointCloud points = sampled(makeDumbbell(), 5000);
    ASSERT_TRUE(addGaussianNoise(points, 0.005, 3));
    const Segmentation s = found(points);
    PointCloud reversed(points.rbegin(), points.rend());
    const Segmentation r = found(reversed);
    EXPECT_EQ(s.volume, r.volume);
    EXPECT_EQ(s.size, r.size);
    EXPECT_EQ(s.quality, r.quality);
    Random random(4);
    Motion motion;
    motion.rotation = randomRotation(random);
    motion.translation = {10.0, 20.0, -5.0};
    motion.scale = 0.037;
    const Segmentation m = found(applyToCloud(motion, points));
    EXPECT_NEAR(m.volume / (s.volume * 0.037 * 0.037 * 0.037), 1.0, 1e-3);
    EXPECT_NEAR(m.size / (s.size * 0.037), 1.0, 1e-3);
    EXPECT_NEAR(m.quality, s.quality, 0.01);
    EXPECT_EQ(m.angleDegrees, s.angleDegrees);
}

TEST(AdaptiveInterior, SourcesHaveNames) {
    EXPECT_STREQ(interiorSourceName(InteriorSource::kWalk), "walk");
    EXPECT_STREQ(interiorSourceName(InteriorSource::kPotential), "potential");
    EXPECT_STREQ(interiorSourceName(InteriorSource::kThickened), "thickened");
}

}  // namespace
}  // namespace shapedb
