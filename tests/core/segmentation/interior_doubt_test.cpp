// SPDX-License-Identifier: GPL-3.0-or-later
// Scans that have no surface, or walls that the points do not resolve, say so.
#include <cmath>

#include <gtest/gtest.h>

#include "core/base/math.h"
#include "core/base/random.h"
#include "core/pipeline.h"
#include "core/synthetic/degrade.h"
#include "core/synthetic/families.h"
#include "core/synthetic/named_shapes.h"

namespace shapedb {
namespace {

// An open cup: outer radius 0.55, wall and bottom 0.05, height 1.2; noise as a share of the diagonal.
PointCloud openCup(std::size_t count, double noise) {
    constexpr double kOuter = 0.55;
    constexpr double kInner = 0.5;
    constexpr double kHeight = 1.2;
    constexpr double kBottom = 0.05;
    const double areas[] = {2.0 * kOuter * kHeight, 2.0 * kInner * (kHeight - kBottom), kOuter * kOuter,
                            kInner * kInner, kOuter * kOuter - kInner * kInner};
    double all = 0.0;
    for (const double area : areas) all += area;
    Random random(1);
    PointCloud points;
    while (points.size() < count) {
        double at = random.uniform() * all;
        int face = 0;
        while (face < 4 && at > areas[face]) at -= areas[face++];
        const double angle = random.uniform(0.0, 2.0 * kPi);
        const double root = std::sqrt(random.uniform());
        double radius = kOuter;
        double height = 0.0;
        switch (face) {
            case 0: height = random.uniform(0.0, kHeight); break;
            case 1:
                radius = kInner;
                height = random.uniform(kBottom, kHeight);
                break;
            case 2: radius = kOuter * root; break;
            case 3:
                radius = kInner * root;
                height = kBottom;
                break;
            default: radius = std::sqrt(random.uniform(kInner * kInner, kOuter * kOuter)); height = kHeight;
        }
        points.push_back({radius * std::cos(angle), radius * std::sin(angle), height});
    }
    EXPECT_TRUE(addGaussianNoise(points, noise, 1));
    return points;
}

Segmentation segmented(const PointCloud& points) {
    return describe(points, parametersOf(Profile::kDefault)).value().segmentation;
}

TEST(InteriorDoubt, OpenCupsAreRightOrSayThatTheirWallsAreThin) {
    const double volume = kPi * (0.55 * 0.55 * 1.2 - 0.5 * 0.5 * 1.15);
    for (const std::size_t count : {3000, 12000, 50000}) {
        for (const double noise : {0.0, 0.001, 0.003, 0.005}) {
            const Segmentation cup = segmented(openCup(count, noise));
            const bool right = std::abs(cup.volume - volume) < 0.2 * volume;
            if (right && cup.doubt == InteriorDoubt::kNone) continue;
            EXPECT_EQ(cup.doubt, InteriorDoubt::kThinWalls) << count << " points, noise " << noise;
            EXPECT_LE(cup.quality, 0.4) << count << " points, noise " << noise;
        }
    }
}

TEST(InteriorDoubt, FewPointsLowerTheQualityHoweverWellAnInteriorFits) {
    const double volume = kPi * (0.55 * 0.55 * 1.2 - 0.5 * 0.5 * 1.15);
    double before = 0.0;
    for (const std::size_t count : {50, 100, 200, 300, 500}) {
        const Segmentation cup = segmented(openCup(count, 0.0));
        EXPECT_GT(std::abs(cup.volume - volume), 0.2 * volume) << count << ": so few do not show its hollow";
        EXPECT_LT(cup.quality, 0.69) << count;
        EXPECT_NE(cup.doubt, InteriorDoubt::kNone) << count;
        // A ball is right with so few; nobody can know.
        ScanOptions options;
        options.count = count;
        const Segmentation ball = segmented(scanOf(makeSphere().solid, options).value());
        EXPECT_EQ(ball.doubt, InteriorDoubt::kFewPoints) << count;
        EXPECT_GT(ball.quality, before) << count << ": more with more points";
        EXPECT_LE(ball.quality, std::sqrt(static_cast<double>(count) / 1000.0)) << count;
        before = ball.quality;
    }
    const ScanOptions options{1000, 0.0, 1, true};
    EXPECT_EQ(segmented(scanOf(makeSphere().solid, options).value()).doubt, InteriorDoubt::kNone);
    // The published walk rates nothing.
    const auto paper = describe(scanOf(makeSphere().solid, ScanOptions{500, 0.0, 1, true}).value(),
                                parametersOf(Profile::kPaper));
    ASSERT_TRUE(paper);
    EXPECT_EQ(paper->segmentation.doubt, InteriorDoubt::kNone);
}

TEST(InteriorDoubt, PointsRepeatedManyTimesAreNoMore) {
    const PointCloud few = scanOf(makeSphere().solid, ScanOptions{200, 0.0, 1, true}).value();
    PointCloud many;
    for (int i = 0; i < 30; ++i) many.insert(many.end(), few.begin(), few.end());
    EXPECT_EQ(segmented(many).quality, segmented(few).quality);
    EXPECT_EQ(segmented(many).doubt, InteriorDoubt::kFewPoints);
}

TEST(InteriorDoubt, PointsThatFillSpaceHaveNoSurface) {
    for (const std::size_t count : {3000, 12000}) {
        Random random(2);
        PointCloud blob;
        PointCloud cube;
        for (std::size_t i = 0; i < count; ++i) {
            blob.push_back({random.normal(), random.normal(), random.normal()});
            cube.push_back({random.uniform(), random.uniform(), random.uniform()});
        }
        for (const PointCloud& points : {blob, cube}) {
            const Segmentation filled = segmented(points);
            EXPECT_EQ(filled.doubt, InteriorDoubt::kNoSurface) << count;
            EXPECT_LE(filled.quality, 0.1) << count;
        }
    }
}

TEST(InteriorDoubt, ClosedShapesRaiseNone) {
    for (const FamilyInfo& family : listFamilies()) {
        for (const double noise : {0.0, 0.005}) {
            ScanOptions options;
            options.count = 8000;
            options.noise = noise;
            const PointCloud points = scanOf(makeMember(family.name, 1, 1).value(), options).value();
            EXPECT_EQ(segmented(points).doubt, InteriorDoubt::kNone) << family.name << ", noise " << noise;
        }
    }
}

}  // namespace
}  // namespace shapedb
