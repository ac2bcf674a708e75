// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/base/error.h"

#include <regex>
#include <set>
#include <string>

#include <gtest/gtest.h>

namespace shapedb {
namespace {

// kInternal is documented as the last value; the loop covers the whole closed enum.
constexpr int kCount = static_cast<int>(ErrorCode::kInternal) + 1;

TEST(Error, NamesRoundTripToCodes) {
    for (int i = 0; i < kCount; ++i) {
        const auto code = static_cast<ErrorCode>(i);
        EXPECT_EQ(errorCodeFromName(errorCodeName(code)), code) << errorCodeName(code);
    }
}

TEST(Error, NamesAreDistinctSnakeCase) {
    std::set<std::string> names;
    const std::regex snakeCase("[a-z]+(_[a-z]+)*");
    for (int i = 0; i < kCount; ++i) {
        const std::string name = errorCodeName(static_cast<ErrorCode>(i));
        EXPECT_TRUE(std::regex_match(name, snakeCase)) << name;
        EXPECT_TRUE(names.insert(name).second) << name << " appears twice";
    }
}

// The names are stored in databases and read by scripts: a rename breaks them.
TEST(Error, StoredNamesAreFrozen) {
    EXPECT_STREQ(errorCodeName(ErrorCode::kNonFiniteCoordinate), "non_finite_coordinate");
    EXPECT_STREQ(errorCodeName(ErrorCode::kTooFewPoints), "too_few_points");
    EXPECT_STREQ(errorCodeName(ErrorCode::kCoplanar), "coplanar");
    EXPECT_STREQ(errorCodeName(ErrorCode::kNoInterior), "no_interior");
    EXPECT_STREQ(errorCodeName(ErrorCode::kQueueFull), "queue_full");
    EXPECT_STREQ(errorCodeName(ErrorCode::kDeadlineExceeded), "deadline_exceeded");
    EXPECT_STREQ(errorCodeName(ErrorCode::kSchemaTooNew), "schema_too_new");
    EXPECT_STREQ(errorCodeName(ErrorCode::kInternal), "internal");
}

TEST(Error, UnknownNameMapsToInternal) {
    EXPECT_EQ(errorCodeFromName("written_by_a_newer_version"), ErrorCode::kInternal);
    EXPECT_EQ(errorCodeFromName(""), ErrorCode::kInternal);
    EXPECT_EQ(errorCodeFromName("Coplanar"), ErrorCode::kInternal);
}

TEST(Error, FailCarriesCodeAndMessage) {
    const auto refuse = [](bool bad) -> Result<int> {
        if (bad) return fail(ErrorCode::kNotFound, "no shape \"a\"");
        return 7;
    };
    EXPECT_EQ(refuse(false).value(), 7);
    const Result<int> refused = refuse(true);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::kNotFound);
    EXPECT_EQ(refused.error().message, "no shape \"a\"");
    const auto passOn = [&]() -> Result<std::string> { return fail(refused.error()); };
    EXPECT_EQ(passOn().error().message, "no shape \"a\"");
}

}  // namespace
}  // namespace shapedb
