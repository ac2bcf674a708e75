#include "client/cli/parameters.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace shapedb::cli {
namespace {

TEST(Parameters, NothingGivenIsTheDefaultProfile) {
    const ParameterFlags flags;
    EXPECT_FALSE(flags.any());
    const auto resolved = flags.resolve();
    ASSERT_TRUE(resolved);
    EXPECT_EQ(toJson(*resolved), toJson(parametersOf(Profile::kDefault)));
    EXPECT_FALSE(flags.forServer().profile.has_value());
}

TEST(Parameters, EachFlagOverridesItsFieldOnly) {
    ParameterFlags flags;
    flags.profile = "paper";
    flags.interior = "adaptive";
    flags.numbers.bigBallRatio = 0.75;
    flags.numbers.deepAngleDegrees = 25.0;
    flags.numbers.hullAngleDegrees = 6.0;
    flags.numbers.mergeRatio = 2.0;
    flags.numbers.decimateTo = 5000;
    flags.numbers.mergeContrast = 1.75;
    flags.numbers.minSegmentShare = 0.03125;
    flags.numbers.maxSegments = 12;
    flags.numbers.outlierRatio = 4.0;
    flags.numbers.smoothingReach = 6.0;
    flags.numbers.thinning = 1.5;
    flags.numbers.maxPoints = 9;
    flags.numbers.attributes = true;
    const auto resolved = flags.resolve();
    ASSERT_TRUE(resolved) << resolved.error().message;
    EXPECT_EQ(toJson(*resolved), nlohmann::json({{"profile", "paper"},
                                                 {"big_ball_ratio", 0.75},
                                                 {"deep_angle_degrees", 25.0},
                                                 {"hull_angle_degrees", 6.0},
                                                 {"merge_ratio", 2.0},
                                                 {"decimate_to", 5000},
                                                 {"merge_contrast", 1.75},
                                                 {"min_segment_share", 0.03125},
                                                 {"max_segments", 12},
                                                 {"outlier_ratio", 4.0},
                                                 {"smoothing_reach", 6.0},
                                                 {"thinning", 1.5},
                                                 {"interior_method", "adaptive"},
                                                 {"max_points", 9},
                                                 {"attributes", true}}));
    const client::Parameters sent = flags.forServer();
    EXPECT_EQ(sent.profile, client::Profile::kPaper);
    EXPECT_EQ(sent.interiorMethod, client::InteriorMethod::kAdaptive);
    EXPECT_EQ(toJson(sent), toJson(*resolved)) << "what a collection shows is what a scan here would get";
}

TEST(Parameters, AnySingleFlagIsNoticed) {
    ParameterFlags contrast;
    contrast.numbers.mergeContrast = 0.0;
    EXPECT_TRUE(contrast.any()) << "0 given is not nothing given";
    ParameterFlags interior;
    interior.interior = "walk";
    EXPECT_TRUE(interior.any());
    EXPECT_EQ(interior.forServer().interiorMethod, client::InteriorMethod::kWalk);
    ParameterFlags points;
    points.numbers.maxPoints = 3;
    EXPECT_TRUE(points.any());
}

TEST(Parameters, ZeroTurnsOffWhatTheProfileTurnsOn) {
    ParameterFlags flags;
    flags.numbers.decimateTo = 0;
    flags.numbers.mergeContrast = 0.0;
    flags.numbers.outlierRatio = 0.0;
    flags.numbers.smoothingReach = 0.0;
    flags.numbers.thinning = 0.0;
    flags.interior = "walk";
    flags.numbers.attributes = false;
    flags.numbers.deepAngleDegrees = 20.0;
    const auto resolved = flags.resolve();
    ASSERT_TRUE(resolved) << resolved.error().message;
    nlohmann::json expected = toJson(parametersOf(Profile::kPaper));
    expected["profile"] = "default";
    for (const char* name : {"min_segment_share", "max_segments", "max_points"}) {
        expected[name] = toJson(*resolved)[name];
    }
    EXPECT_EQ(toJson(*resolved), expected);
}

TEST(Parameters, OutOfRangeIsRefusedWithItsRange) {
    ParameterFlags flags;
    flags.numbers.deepAngleDegrees = 90.0;
    const auto resolved = flags.resolve();
    ASSERT_FALSE(resolved);
    EXPECT_EQ(resolved.error().code, ErrorCode::kInvalidArgument);
}

TEST(Parameters, ScoreFlagsTurnReflectionOffAndScaleOn) {
    EXPECT_TRUE(ScoreFlags{}.resolve().reflection);
    EXPECT_FALSE(ScoreFlags{}.resolve().keepScale);
    EXPECT_FALSE((ScoreFlags{true, true, false}.resolve().reflection));
    EXPECT_TRUE((ScoreFlags{true, true, false}.resolve().keepScale));
    EXPECT_FALSE(ScoreFlags{}.resolve().partial);
    EXPECT_TRUE((ScoreFlags{false, false, true}.resolve().partial));
}

}  // namespace
}  // namespace shapedb::cli
