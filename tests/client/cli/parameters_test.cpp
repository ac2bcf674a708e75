// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/parameters.h"

#include <algorithm>

#include <CLI/CLI.hpp>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace shapedb::cli {
namespace {

TEST(Parameters, WithoutFlagsTheDefaultProfileApplies) {
    const ParameterFlags flags;
    EXPECT_FALSE(flags.any());
    const auto resolved = flags.resolve();
    ASSERT_TRUE(resolved);
    EXPECT_EQ(toJson(*resolved), toJson(parametersOf(Profile::kDefault)));
    EXPECT_FALSE(flags.given.profile.has_value());
}

TEST(Parameters, EachFlagOverridesOnlyItsField) {
    ParameterFlags flags;
    flags.given.profile = Profile::kPaper;
    flags.given.interiorMethod = InteriorMethod::kAdaptive;
    flags.given.bigBallRatio = 0.75;
    flags.given.deepAngleDegrees = 25.0;
    flags.given.hullAngleDegrees = 6.0;
    flags.given.mergeRatio = 2.0;
    flags.given.decimateTo = 5000;
    flags.given.mergeContrast = 1.75;
    flags.given.minSegmentShare = 0.03125;
    flags.given.maxSegments = 12;
    flags.given.outlierRatio = 4.0;
    flags.given.smoothingReach = 6.0;
    flags.given.thinning = 1.5;
    flags.given.maxPoints = 9;
    flags.given.attributes = true;
    flags.given.views = true;
    flags.given.unit = LengthUnit::kMillimetre;
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
                                                 {"stray_ratio", 4.0},   // former name of outlier_ratio
                                                 {"even_spacing", 1.5},  // former name of thinning
                                                 {"interior_method", "adaptive"},
                                                 {"max_points", 9},
                                                 {"attributes", true},
                                                 {"views", true},
                                                 {"unit", "mm"}}));
    EXPECT_EQ(toJson(flags.given), toJson(*resolved)) << "a collection shows what a scan here would get";
}

TEST(Parameters, AnyNoticesASingleFlag) {
    ParameterFlags contrast;
    contrast.given.mergeContrast = 0.0;
    EXPECT_TRUE(contrast.any()) << "an explicit 0 counts as set";
    ParameterFlags interior;
    interior.given.interiorMethod = InteriorMethod::kWalk;
    EXPECT_TRUE(interior.any());
    ParameterFlags points;
    points.given.maxPoints = 3;
    EXPECT_TRUE(points.any());
}

struct Parsed {
    ParameterFlags flags;
    std::string help;
    bool refused = false;
};

/// Flags as a command reads them.
Parsed parse(std::vector<std::string> arguments) {
    Parsed parsed;
    CLI::App app;
    addParameterFlags(app, parsed.flags);
    std::reverse(arguments.begin(), arguments.end());
    try {
        app.parse(arguments);
    } catch (const CLI::ParseError&) {
        parsed.refused = true;
    }
    parsed.help = app.help();
    return parsed;
}

TEST(Parameters, NamedValuesAreParsed) {
    const Parsed parsed = parse({"--profile", "paper", "--interior", "adaptive", "--no-attributes"});
    ASSERT_FALSE(parsed.refused);
    EXPECT_EQ(parsed.flags.given.profile, Profile::kPaper);
    EXPECT_EQ(parsed.flags.given.interiorMethod, InteriorMethod::kAdaptive);
    EXPECT_EQ(parsed.flags.given.attributes, false);
    EXPECT_TRUE(parse({"--profile", "best"}).refused);
}

TEST(Parameters, FormerFlagNamesStillWorkButAreNotInTheHelp) {
    const Parsed former = parse({"--stray-ratio", "4", "--even-spacing", "1.5"});
    ASSERT_FALSE(former.refused);
    EXPECT_EQ(former.flags.given.outlierRatio, 4.0);
    EXPECT_EQ(former.flags.given.thinning, 1.5);
    const Parsed current = parse({"--outlier-ratio", "4", "--thinning", "1.5"});
    EXPECT_EQ(toJson(former.flags.given), toJson(current.flags.given));
    EXPECT_NE(former.help.find("--outlier-ratio"), std::string::npos);
    EXPECT_NE(former.help.find("--thinning"), std::string::npos);
    EXPECT_EQ(former.help.find("--stray-ratio"), std::string::npos);
    EXPECT_EQ(former.help.find("--even-spacing"), std::string::npos);
    EXPECT_EQ(former.help.find("Excludes"), std::string::npos);
    EXPECT_TRUE(parse({"--outlier-ratio", "4", "--stray-ratio", "3"}).refused) << "one or the other";
}

TEST(Parameters, ZeroTurnsOffWhatTheProfileTurnsOn) {
    ParameterFlags flags;
    flags.given.decimateTo = 0;
    flags.given.mergeContrast = 0.0;
    flags.given.outlierRatio = 0.0;
    flags.given.smoothingReach = 0.0;
    flags.given.thinning = 0.0;
    flags.given.interiorMethod = InteriorMethod::kWalk;
    flags.given.attributes = false;
    flags.given.deepAngleDegrees = 20.0;
    const auto resolved = flags.resolve();
    ASSERT_TRUE(resolved) << resolved.error().message;
    nlohmann::json expected = toJson(parametersOf(Profile::kPaper));
    expected["profile"] = "default";
    for (const char* name : {"min_segment_share", "max_segments", "max_points", "views"}) {
        expected[name] = toJson(*resolved)[name];
    }
    EXPECT_EQ(toJson(*resolved), expected);
}

TEST(Parameters, RefusesAValueOutOfRange) {
    ParameterFlags flags;
    flags.given.deepAngleDegrees = 90.0;
    const auto resolved = flags.resolve();
    ASSERT_FALSE(resolved);
    EXPECT_EQ(resolved.error().code, ErrorCode::kInvalidArgument);
}

TEST(Parameters, ScoreFlagsSetTheScoreOptions) {
    EXPECT_TRUE(ScoreFlags{}.resolve().reflection);
    EXPECT_FALSE(ScoreFlags{}.resolve().keepScale);
    EXPECT_FALSE((ScoreFlags{true, true, false}.resolve().reflection));
    EXPECT_TRUE((ScoreFlags{true, true, false}.resolve().keepScale));
    EXPECT_FALSE(ScoreFlags{}.resolve().partial);
    EXPECT_TRUE((ScoreFlags{false, false, true}.resolve().partial));
}

}  // namespace
}  // namespace shapedb::cli
