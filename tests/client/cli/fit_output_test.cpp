// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/fit_output.h"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace shapedb::cli {
namespace {

client::Fit fitOf(bool reflected, bool handednessOpen) {
    client::Fit fit;
    fit.best.motion.reflected = reflected;
    fit.handednessOpen = handednessOpen;
    return fit;
}

TEST(FitOutput, MirroredIsWhatFitsInNoOtherWay) {
    EXPECT_TRUE(fitsMirrored(fitOf(true, false)));
    EXPECT_FALSE(fitsMirrored(fitOf(true, true))) << "the points do not tell left from right";
    EXPECT_FALSE(fitsMirrored(fitOf(false, false)));
    EXPECT_EQ(mirroredCell(fitsMirrored(std::optional(fitOf(true, false)))), "1");
    EXPECT_EQ(mirroredCell(fitsMirrored(std::optional(fitOf(true, true)))), "0");
    EXPECT_EQ(mirroredCell(fitsMirrored(std::optional<client::Fit>())), "");
    EXPECT_TRUE(mirroredJson(std::nullopt).is_null());
    EXPECT_EQ(mirroredJson(true), true);
}

TEST(FitOutput, LikenessIsTheVerdictAndWhetherItIsMirrored) {
    EXPECT_EQ(likenessText(Verdict::kSameObject, true), "same object, mirrored");
    EXPECT_EQ(likenessText(Verdict::kSameObject, false), "same object");
    EXPECT_EQ(likenessText(Verdict::kSameKind, std::nullopt), "same kind");
    EXPECT_EQ(likenessText(Verdict::kUnrelated, true), "unrelated") << "nobody's mirror image";
    EXPECT_EQ(likenessText(Verdict::kSameKind, true), "same kind") << "another object";
    EXPECT_EQ(likenessText(Verdict::kNone, true), "mirrored");
    EXPECT_EQ(likenessText(Verdict::kNone, false), "");
    EXPECT_EQ(likenessText(Verdict::kPart, false), "query is part of it");
    EXPECT_EQ(likenessText(Verdict::kPart, true, "part of it"), "part of it, mirrored");
}

}  // namespace
}  // namespace shapedb::cli
