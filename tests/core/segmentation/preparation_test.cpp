#include "core/segmentation/preparation.h"

#include <string>

#include <gtest/gtest.h>

#include "core/geometry/noise.h"
#include "core/synthetic/named_shapes.h"

namespace shapedb {
namespace {

SegmentationOptions everything() {
    SegmentationOptions options;
    options.decimateTo = 3000;
    options.strayRatio = 3.0;
    options.smoothingReach = 5.0;
    options.evenSpacing = 1.0;
    return options;
}

PointCloud noisyTorus() {
    auto points = sampleBoundary(makeTorus().solid, 5000, 1);
    EXPECT_TRUE(points && addGaussianNoise(*points, 0.005, 2));
    points->push_back({30.0, 0.0, 0.0});
    points->push_back(points->front());
    return *points;
}

Result<PreparedPoints> prepared(const PointCloud& points, const SegmentationOptions& options,
                                std::vector<std::string>* stages = nullptr) {
    return preparePoints(points, options, {}, [&](const char* stage) -> Result<void> {
        if (stages != nullptr) stages->push_back(stage);
        return {};
    });
}

TEST(PreparePoints, WithNothingAskedOnlySanitises) {
    const PointCloud points = noisyTorus();
    std::vector<std::string> stages;
    const auto result = prepared(points, SegmentationOptions{}, &stages);
    ASSERT_TRUE(result);
    EXPECT_EQ(stages, std::vector<std::string>{"sanitise"});
    EXPECT_EQ(result->sites, sanitise(points)->points);
    EXPECT_EQ(result->strays, 0u);
    EXPECT_EQ(result->duplicates, 1u);
}

TEST(PreparePoints, EveryPointHasItsSiteOrIsAStray) {
    const PointCloud points = noisyTorus();
    std::vector<std::string> stages;
    const auto result = prepared(points, everything(), &stages);
    ASSERT_TRUE(result);
    EXPECT_EQ(stages, (std::vector<std::string>{"sanitise", "decimate", "strays", "smooth", "even_spacing"}));
    ASSERT_EQ(result->siteOfPoint.size(), points.size());
    EXPECT_LE(result->sites.size(), 3000u);
    std::uint64_t strays = 0;
    const double far = 6.0 * (result->noise.sigma + result->spacing) * result->frame.unit;
    for (std::size_t i = 0; i < points.size(); ++i) {
        const std::uint32_t site = result->siteOfPoint[i];
        if (site == kNoSite) {
            ++strays;
            continue;
        }
        ASSERT_LT(site, result->sites.size());
        EXPECT_LT(distance(result->frame.toScan(result->sites[site]), points[i]), far);
    }
    EXPECT_EQ(strays, result->strays);
    EXPECT_GE(strays, 1u);
    EXPECT_LT(strays, points.size() / 20);
    EXPECT_EQ(result->siteOfPoint[points.size() - 2], kNoSite);
    for (std::size_t i = 1; i < result->sites.size(); ++i) {
        EXPECT_TRUE(lexicographicLess(result->sites[i - 1], result->sites[i]));
    }
}

TEST(PreparePoints, StopsWhenToldTo) {
    for (const char* last : {"sanitise", "decimate", "strays", "smooth", "even_spacing"}) {
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
