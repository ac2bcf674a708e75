// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/store/parameters_codec.h"

#include <gtest/gtest.h>

#include "core/base/random.h"

namespace shapedb::store {
namespace {

void expectSame(const ShapeParameters& a, const ShapeParameters& b) {
    EXPECT_EQ(a.profile, b.profile);
    EXPECT_EQ(a.segmentation.bigBallRatio, b.segmentation.bigBallRatio);
    EXPECT_EQ(a.segmentation.deepAngleDegrees, b.segmentation.deepAngleDegrees);
    EXPECT_EQ(a.segmentation.hullAngleDegrees, b.segmentation.hullAngleDegrees);
    EXPECT_EQ(a.segmentation.mergeRatio, b.segmentation.mergeRatio);
    EXPECT_EQ(a.segmentation.preparation.decimateTo, b.segmentation.preparation.decimateTo);
    EXPECT_EQ(a.segmentation.mergeContrast, b.segmentation.mergeContrast);
    EXPECT_EQ(a.segmentation.minSegmentShare, b.segmentation.minSegmentShare);
    EXPECT_EQ(a.segmentation.maxSegments, b.segmentation.maxSegments);
    EXPECT_EQ(a.segmentation.preparation.outlierRatio, b.segmentation.preparation.outlierRatio);
    EXPECT_EQ(a.segmentation.preparation.smoothingReach, b.segmentation.preparation.smoothingReach);
    EXPECT_EQ(a.segmentation.preparation.thinning, b.segmentation.preparation.thinning);
    EXPECT_EQ(a.segmentation.interiorMethod, b.segmentation.interiorMethod);
    EXPECT_EQ(a.signature.maxPoints, b.signature.maxPoints);
    EXPECT_EQ(a.signature.attributes, b.signature.attributes);
    EXPECT_EQ(a.views, b.views);
    EXPECT_EQ(a.unit, b.unit);
}

// The text is persisted: these names never change.
TEST(ParametersCodec, TextIsFrozen) {
    EXPECT_EQ(encodeParameters(parametersOf(Profile::kPaper)),
              R"({"profile":"paper","segmentation":{"big_ball_ratio":0.5,"deep_angle_degrees":20.0,)"
              R"("hull_angle_degrees":5.0,"merge_ratio":1.5,"decimate_to":0,"merge_contrast":0.0,)"
              R"("min_segment_share":0.004,"max_segments":16,"stray_ratio":0.0,"smoothing_reach":0.0,)"
              R"("even_spacing":0.0,"interior_method":"walk"},"signature":{"max_points":7,)"
              R"("attributes":false},"views":false,"unit":"none"})");
}

// Text written before outliers and smoothing existed: such collections keep working as they did, though
// the profile of the same name now turns more on.
TEST(ParametersCodec, ReadsTextOfOlderServers) {
    for (const char* name : {"paper", "default"}) {
        const auto decoded =
            decodeParameters(std::string(R"({"profile":")") + name +
                             R"(","segmentation":{"big_ball_ratio":0.5,"deep_angle_degrees":20.0,)"
                             R"("hull_angle_degrees":5.0,"merge_ratio":1.5,"decimate_to":50000},)"
                             R"("signature":{"max_points":7}})");
        ASSERT_TRUE(decoded) << decoded.error().message;
        ShapeParameters expected = parametersOf(Profile::kPaper);
        expected.profile = *profileFromName(name);
        expected.segmentation.preparation.decimateTo = 50'000;
        // Views change no signature: these collections get them with their next rebuild.
        expected.views = parametersOf(expected.profile).views;
        expectSame(*decoded, expected);
        EXPECT_EQ(decoded->segmentation.mergeContrast, 0.0);
        EXPECT_EQ(decoded->segmentation.preparation.outlierRatio, 0.0);
        EXPECT_EQ(decoded->segmentation.preparation.smoothingReach, 0.0);
        EXPECT_EQ(decoded->segmentation.preparation.thinning, 0.0);
        EXPECT_EQ(decoded->segmentation.interiorMethod, InteriorMethod::kWalk);
        EXPECT_FALSE(decoded->signature.attributes);
    }
}

TEST(ParametersCodec, RoundTripIsExact) {
    Random random(1);
    for (int i = 0; i < 200; ++i) {
        ShapeParameters parameters = parametersOf(i % 2 == 0 ? Profile::kPaper : Profile::kDefault);
        parameters.segmentation.bigBallRatio = random.uniform(1e-6, 10.0);
        parameters.segmentation.deepAngleDegrees = random.uniform(0.1, 89.9);
        parameters.segmentation.hullAngleDegrees = random.uniform(0.1, 89.9);
        parameters.segmentation.mergeRatio = random.uniform(1.0, 9.0);
        parameters.segmentation.preparation.decimateTo =
            i % 3 == 0 ? 0 : 1'000 + static_cast<std::uint32_t>(random.below(100'000));
        parameters.segmentation.mergeContrast = i % 4 == 0 ? 0.0 : random.uniform(1.0, 9.0);
        parameters.segmentation.minSegmentShare = random.uniform(0.0, 1.0);
        parameters.segmentation.maxSegments = static_cast<std::uint32_t>(random.below(100));
        parameters.segmentation.preparation.outlierRatio = i % 4 == 1 ? 0.0 : random.uniform(1.1, 9.0);
        parameters.segmentation.preparation.smoothingReach = i % 4 == 2 ? 0.0 : random.uniform(1.0, 20.0);
        parameters.segmentation.preparation.thinning = i % 4 == 3 ? 0.0 : random.uniform(0.1, 10.0);
        parameters.segmentation.interiorMethod =
            i % 5 < 2 ? InteriorMethod::kWalk : InteriorMethod::kAdaptive;
        parameters.signature.maxPoints = 1 + static_cast<std::uint32_t>(random.below(kMaxSignaturePoints));
        parameters.signature.attributes = i % 2 == 0;
        const std::string text = encodeParameters(parameters);
        const auto decoded = decodeParameters(text);
        ASSERT_TRUE(decoded) << decoded.error().message;
        expectSame(*decoded, parameters);
        EXPECT_EQ(encodeParameters(*decoded), text);
    }
}

TEST(ParametersCodec, MissingFieldsAreOffButForViews) {
    for (const Profile profile : {Profile::kPaper, Profile::kDefault}) {
        const auto decoded =
            decodeParameters(std::string(R"({"profile":")") + profileName(profile) + R"("})");
        ASSERT_TRUE(decoded) << decoded.error().message;
        ShapeParameters expected = parametersOf(Profile::kPaper);
        expected.profile = profile;
        expected.views = parametersOf(profile).views;
        expectSame(*decoded, expected);
    }
    const auto partly = decodeParameters(R"({"profile":"paper","segmentation":{"merge_ratio":2}})");
    ASSERT_TRUE(partly);
    EXPECT_EQ(partly->segmentation.mergeRatio, 2.0);
    EXPECT_EQ(partly->segmentation.bigBallRatio, 0.5);
}

TEST(ParametersCodec, RefusesEverythingElseByName) {
    const struct {
        const char* text;
        const char* word;
    } cases[] = {
        {"", ""},
        {"{", ""},
        {"[]", "object"},
        {"{}", "profile"},
        {R"({"profile":"best"})", "best"},
        {R"({"profile":1})", "profile"},
        {R"({"profile":"paper","extra":1})", "extra"},
        {R"({"profile":"paper","profile":"default"})", "twice"},
        {R"({"profile":"paper","segmentation":[]})", "segmentation"},
        {R"({"profile":"paper","segmentation":{"big_bal_ratio":1}})", "segmentation.big_bal_ratio"},
        {R"({"profile":"paper","segmentation":{"merge_ratio":2,"merge_ratio":3}})", "twice"},
        {R"({"profile":"paper","segmentation":{"merge_ratio":"2"}})", "segmentation.merge_ratio"},
        {R"({"profile":"paper","segmentation":{"decimate_to":-1}})", "segmentation.decimate_to"},
        {R"({"profile":"paper","segmentation":{"decimate_to":4294967296}})", "segmentation.decimate_to"},
        {R"({"profile":"paper","segmentation":{"deep_angle_degrees":90}})", "90"},
        {R"({"profile":"paper","segmentation":{"interior_method":"guess"}})", "guess"},
        {R"({"profile":"paper","signature":{"attributes":1}})", "signature.attributes"},
        {R"({"profile":"paper","segmentation":{"interior_method":1}})", "segmentation.interior_method"},
        {R"({"profile":"paper","segmentation":{"merge_contrast":0.5}})", "merge_contrast"},
        {R"({"profile":"paper","segmentation":{"max_segments":1.5}})", "segmentation.max_segments"},
        {R"({"profile":"paper","signature":{"max_points":1.5}})", "signature.max_points"},
        {R"({"profile":"paper","signature":{"max_points":33}})", "33"},
        {"{\"profile\":\"\xff\"}", ""},
    };
    for (const auto& one : cases) {
        const auto decoded = decodeParameters(one.text);
        ASSERT_FALSE(decoded) << one.text;
        EXPECT_EQ(decoded.error().code, ErrorCode::kDataLoss) << one.text;
        EXPECT_NE(decoded.error().message.find(one.word), std::string::npos) << decoded.error().message;
    }
}

}  // namespace
}  // namespace shapedb::store
