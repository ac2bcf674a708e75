// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/preparation/prepare_points.h"

#include <array>
#include <cstdint>
#include <string>

#include <gtest/gtest.h>

#include "core/base/random.h"
#include "core/preparation/sanitise.h"
#include "core/synthetic/degrade.h"
#include "core/synthetic/named_shapes.h"

namespace shapedb {
namespace {

PreparationOptions everything() {
    PreparationOptions options;
    options.decimateTo = 3000;
    options.outlierRatio = 3.0;
    options.smoothingReach = 5.0;
    options.thinning = 1.0;
    return options;
}

PointCloud noisyTorus() {
    auto points = sampleBoundary(makeTorus().solid, 5000, 1);
    EXPECT_TRUE(points && addGaussianNoise(*points, 0.005, 2));
    points->push_back({30.0, 0.0, 0.0});
    points->push_back(points->front());
    return *points;
}

Result<PreparedPoints> prepared(const PointCloud& points, const PreparationOptions& options,
                                std::vector<std::string>* stages = nullptr) {
    return preparePoints(points, options, {}, [&](const char* stage) -> Result<void> {
        if (stages != nullptr) stages->push_back(stage);
        return {};
    });
}

// Cubes of edge 1 in a row of rows, `perCube` points on the surface of each.
PointCloud cubes(int count, int perCube, double noise) {
    Random random(3);
    PointCloud points;
    for (int cube = 0; cube < count; ++cube) {
        const Point3 corner{2.0 * (cube % 10), 2.0 * (cube / 10), 0.0};
        for (int i = 0; i < perCube; ++i) {
            std::array<double, 3> at = {random.uniform(0, 1), random.uniform(0, 1), random.uniform(0, 1)};
            at[random.below(3)] = static_cast<double>(random.below(2));
            points.push_back(corner + Point3{at[0], at[1], at[2]});
        }
    }
    EXPECT_TRUE(addGaussianNoise(points, noise, 4));
    return points;
}

TEST(PreparePoints, ThicknessOfSmallBodiesIsNotTakenForNoise) {
    PreparationOptions options = everything();
    options.decimateTo = 20000;
    for (const int perCube : {100, 200, 400}) {
        for (const double noise : {0.0, 0.0003}) {
            const auto result = prepared(cubes(100, perCube, noise), options);
            ASSERT_TRUE(result);
            EXPECT_LT(result->outliers, static_cast<std::uint64_t>(perCube)) << perCube << " " << noise;
            // Of the edge: the smallest neighbourhoods see the edges.
            EXPECT_LT(result->noise.sigma * result->frame.unit, 0.08) << perCube << " " << noise;
        }
    }
}

TEST(PreparePoints, OnlySanitisesByDefault) {
    const PointCloud points = noisyTorus();
    std::vector<std::string> stages;
    const auto result = prepared(points, PreparationOptions{}, &stages);
    ASSERT_TRUE(result);
    EXPECT_EQ(stages, std::vector<std::string>{"sanitise"});
    EXPECT_EQ(result->sites, sanitise(points)->points);
    EXPECT_EQ(result->outliers, 0u);
    EXPECT_EQ(result->duplicates, 1u);
}

TEST(PreparePoints, MapsEveryPointToASiteOrMarksItAsOutlier) {
    const PointCloud points = noisyTorus();
    std::vector<std::string> stages;
    const auto result = prepared(points, everything(), &stages);
    ASSERT_TRUE(result);
    EXPECT_EQ(stages, (std::vector<std::string>{"sanitise", "decimate", "outliers", "smooth", "thin"}));
    ASSERT_EQ(result->siteOfPoint.size(), points.size());
    EXPECT_LE(result->sites.size(), 3000u);
    std::uint64_t outliers = 0;
    const double far = 6.0 * (result->noise.sigma + result->spacing) * result->frame.unit;
    for (std::size_t i = 0; i < points.size(); ++i) {
        const std::uint32_t site = result->siteOfPoint[i];
        if (site == kNoSite) {
            ++outliers;
            continue;
        }
        ASSERT_LT(site, result->sites.size());
        EXPECT_LT(distance(result->frame.toScan(result->sites[site]), points[i]), far);
    }
    EXPECT_EQ(outliers, result->outliers);
    EXPECT_GE(outliers, 1u);
    EXPECT_LT(outliers, points.size() / 20);
    EXPECT_EQ(result->siteOfPoint[points.size() - 2], kNoSite);
    for (std::size_t i = 1; i < result->sites.size(); ++i) {
        EXPECT_TRUE(lexicographicLess(result->sites[i - 1], result->sites[i]));
    }
}

TEST(PreparePoints, CanBeStoppedAtEachStage) {
    for (const char* last : {"sanitise", "decimate", "outliers", "smooth", "thin"}) {
        const auto result =
            preparePoints(noisyTorus(), everything(), {}, [&](const char* stage) -> Result<void> {
                if (std::string(stage) == last) return fail(ErrorCode::kCancelled, "enough");
                return {};
            });
        ASSERT_FALSE(result);
        EXPECT_EQ(result.error().code, ErrorCode::kCancelled);
    }
}

}  // namespace
}  // namespace shapedb
