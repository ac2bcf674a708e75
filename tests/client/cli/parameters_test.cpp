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
    flags.bigBallRatio = 0.75;
    flags.deepAngle = 25.0;
    flags.hullAngle = 6.0;
    flags.mergeRatio = 2.0;
    flags.decimateTo = 5000;
    flags.maxPoints = 9;
    const auto resolved = flags.resolve();
    ASSERT_TRUE(resolved) << resolved.error().message;
    EXPECT_EQ(toJson(*resolved), nlohmann::json({{"profile", "paper"},
                                                 {"big_ball_ratio", 0.75},
                                                 {"deep_angle_degrees", 25.0},
                                                 {"hull_angle_degrees", 6.0},
                                                 {"merge_ratio", 2.0},
                                                 {"decimate_to", 5000},
                                                 {"max_points", 9}}));
    const client::Parameters sent = flags.forServer();
    EXPECT_EQ(sent.profile, client::Profile::kPaper);
    EXPECT_EQ(sent.bigBallRatio, 0.75);
    EXPECT_EQ(sent.deepAngleDegrees, 25.0);
    EXPECT_EQ(sent.hullAngleDegrees, 6.0);
    EXPECT_EQ(sent.mergeRatio, 2.0);
    EXPECT_EQ(sent.decimateTo, 5000u);
    EXPECT_EQ(sent.maxPoints, 9u);
}

TEST(Parameters, OutOfRangeIsRefusedWithItsRange) {
    ParameterFlags flags;
    flags.deepAngle = 90.0;
    const auto resolved = flags.resolve();
    ASSERT_FALSE(resolved);
    EXPECT_EQ(resolved.error().code, ErrorCode::kInvalidArgument);
}

TEST(Parameters, ScoreFlagsTurnReflectionOffAndScaleOn) {
    EXPECT_TRUE(ScoreFlags{}.resolve().reflection);
    EXPECT_FALSE(ScoreFlags{}.resolve().keepScale);
    EXPECT_FALSE((ScoreFlags{true, true}.resolve().reflection));
    EXPECT_TRUE((ScoreFlags{true, true}.resolve().keepScale));
}

}  // namespace
}  // namespace shapedb::cli
