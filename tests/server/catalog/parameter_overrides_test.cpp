// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/catalog/parameter_overrides.h"

#include <gtest/gtest.h>

namespace shapedb::catalog {
namespace {

TEST(ParameterOverrides, AProfileReplacesAllAndSingleValuesComeAfterIt) {
    ShapeParameters current = parametersOf(Profile::kPaper);
    current.segmentation.mergeRatio = 3.0;
    ParameterOverrides overrides;
    overrides.maxPoints = 9;
    const auto kept = overrides.applyTo(current);
    ASSERT_TRUE(kept);
    EXPECT_EQ(kept->profile, Profile::kPaper);
    EXPECT_EQ(kept->segmentation.mergeRatio, 3.0);
    EXPECT_EQ(kept->signature.maxPoints, 9u);

    overrides.profile = Profile::kDefault;
    const auto replaced = overrides.applyTo(current);
    ASSERT_TRUE(replaced);
    EXPECT_EQ(replaced->profile, Profile::kDefault);
    EXPECT_EQ(replaced->segmentation.mergeRatio, parametersOf(Profile::kDefault).segmentation.mergeRatio);
    EXPECT_EQ(replaced->signature.maxPoints, 9u);
}

TEST(ParameterOverrides, SomethingNewHasTheDefaultProfile) {
    const auto parameters = ParameterOverrides().ofNew();
    ASSERT_TRUE(parameters);
    EXPECT_EQ(parameters->profile, Profile::kDefault);
}

TEST(ParameterOverrides, TheResultIsChecked) {
    ParameterOverrides overrides;
    overrides.mergeRatio = 0.99;
    const auto refused = overrides.ofNew();
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::kInvalidArgument);
}

}  // namespace
}  // namespace shapedb::catalog
