// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/segmentation/options.h"

#include <cmath>
#include <limits>
#include <string>
#include <type_traits>

#include <gtest/gtest.h>

namespace shapedb {
namespace {

TEST(SegmentationOptions, DefaultsAreThoseOfThePaper) {
    const SegmentationOptions options;
    EXPECT_TRUE(validate(options));
    EXPECT_EQ(options.bigBallRatio, 0.5);
    EXPECT_EQ(options.deepAngleDegrees, 20.0);
    EXPECT_EQ(options.hullAngleDegrees, 5.0);
    EXPECT_EQ(options.mergeRatio, 1.5);
    EXPECT_EQ(options.preparation.decimateTo, 0U);
    EXPECT_EQ(options.preparation.outlierRatio, 0.0);
    EXPECT_EQ(options.preparation.smoothingReach, 0.0);
    EXPECT_EQ(options.preparation.thinning, 0.0);
    EXPECT_EQ(options.interiorMethod, InteriorMethod::kWalk);
}

// Sets one field to each value; the error must name the field.
template <typename Options, typename Field>
void expectRefused(Field Options::*field, const std::string& name, std::initializer_list<double> values) {
    for (const double value : values) {
        SegmentationOptions options;
        if constexpr (std::is_same_v<Options, PreparationOptions>) {
            options.preparation.*field = static_cast<Field>(value);
        } else {
            options.*field = static_cast<Field>(value);
        }
        const auto valid = validate(options);
        ASSERT_FALSE(valid) << name << " " << value;
        EXPECT_EQ(valid.error().code, ErrorCode::kInvalidArgument);
        EXPECT_NE(valid.error().message.find(name), std::string::npos) << valid.error().message;
    }
}

TEST(SegmentationOptions, ChecksTheRangeOfEachField) {
    const double nan = std::nan("");
    const double inf = std::numeric_limits<double>::infinity();
    expectRefused(&SegmentationOptions::bigBallRatio, "big_ball_ratio", {0.0, -1.0, nan, inf});
    expectRefused(&SegmentationOptions::deepAngleDegrees, "deep_angle_degrees", {0.0, 90.0, -5.0, nan, inf});
    expectRefused(&SegmentationOptions::hullAngleDegrees, "hull_angle_degrees", {0.0, 90.0, -5.0, nan, inf});
    expectRefused(&SegmentationOptions::mergeRatio, "merge_ratio", {0.999, 0.0, -2.0, nan, inf});
    expectRefused(&PreparationOptions::decimateTo, "decimate_to", {1, 2, 3});
    expectRefused(&PreparationOptions::outlierRatio, "outlier_ratio", {1.0, 0.5, -3.0, nan, inf});
    expectRefused(&PreparationOptions::smoothingReach, "smoothing_reach", {0.5, 20.1, -1.0, nan, inf});
    expectRefused(&PreparationOptions::thinning, "thinning", {10.1, -1.0, nan, inf});
}

TEST(SegmentationOptions, AcceptsTheEndsOfRanges) {
    SegmentationOptions options;
    options.bigBallRatio = 1e-300;
    options.deepAngleDegrees = 89.999;
    options.hullAngleDegrees = 1e-9;
    options.mergeRatio = 1.0;
    options.preparation.decimateTo = 4;
    EXPECT_TRUE(validate(options));
    options.preparation.decimateTo = 4294967295U;
    EXPECT_TRUE(validate(options));
}

}  // namespace
}  // namespace shapedb
