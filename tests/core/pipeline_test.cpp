// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/pipeline.h"

#include <atomic>

#include <gtest/gtest.h>

#include "core/synthetic/named_shapes.h"

namespace shapedb {
namespace {

TEST(Profile, NamesRoundTrip) {
    EXPECT_STREQ(profileName(Profile::kPaper), "paper");
    EXPECT_STREQ(profileName(Profile::kDefault), "default");
    EXPECT_EQ(static_cast<int>(Profile::kPaper), 0) << "persisted";
    EXPECT_EQ(static_cast<int>(Profile::kDefault), 1) << "persisted";
    for (const Profile profile : {Profile::kPaper, Profile::kDefault}) {
        EXPECT_EQ(profileFromName(profileName(profile)).value(), profile);
        EXPECT_EQ(parametersOf(profile).profile, profile);
        EXPECT_TRUE(validate(parametersOf(profile)));
    }
    for (const char* name : {"", "Paper", "papers", "best"}) {
        const auto unknown = profileFromName(name);
        ASSERT_FALSE(unknown) << name;
        EXPECT_EQ(unknown.error().code, ErrorCode::kInvalidArgument);
        EXPECT_NE(unknown.error().message.find("paper"), std::string::npos) << "lists the names";
        EXPECT_NE(unknown.error().message.find("default"), std::string::npos);
    }
}

TEST(Profile, PaperProfileHasThePublishedParameters) {
    const ShapeParameters paper = parametersOf(Profile::kPaper);
    EXPECT_EQ(paper.segmentation.bigBallRatio, 0.5);
    EXPECT_EQ(paper.segmentation.mergeRatio, 1.5);
    EXPECT_EQ(paper.segmentation.deepAngleDegrees, 20.0);
    EXPECT_EQ(paper.segmentation.preparation.decimateTo, 0U) << "all points";
    EXPECT_LT(paper.signature.maxPoints, 10U) << "less than ten";
    EXPECT_GT(parametersOf(Profile::kDefault).segmentation.preparation.decimateTo, 0U);
}

TEST(Describe, ValidatesThenSegmentsAndMakesTheSignature) {
    const PointCloud points = sampleBoundary(makeDumbbell().solid, 2000, 1).value();
    ShapeParameters parameters = parametersOf(Profile::kPaper);
    const auto description = describe(points, parameters);
    ASSERT_TRUE(description);
    EXPECT_TRUE(sameShape(description->signature,
                          makeSignature(description->segmentation, parameters.signature).value()));
    parameters.signature.maxPoints = 0;
    EXPECT_EQ(describe(points, parameters).error().code, ErrorCode::kInvalidArgument);
    EXPECT_EQ(validate(parameters).error().code, ErrorCode::kInvalidArgument);
    parameters = parametersOf(Profile::kPaper);
    parameters.segmentation.mergeRatio = 0.0;
    EXPECT_EQ(describe(points, parameters).error().code, ErrorCode::kInvalidArgument);
    EXPECT_EQ(describe({}, parametersOf(Profile::kPaper)).error().code, ErrorCode::kTooFewPoints);
    const std::atomic<bool> cancel{true};
    RunContext context;
    context.cancel = &cancel;
    EXPECT_EQ(describe(points, parametersOf(Profile::kDefault), context).error().code, ErrorCode::kCancelled);
}

}  // namespace
}  // namespace shapedb
