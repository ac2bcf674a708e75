// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/catalog/request_checks.h"

#include <cmath>
#include <limits>
#include <string>

#include <gtest/gtest.h>

#include "common/safe_text.h"
#include "server/catalog/limits.h"

namespace shapedb::catalog {
namespace {

TEST(RequestChecks, AcceptsOnlyValidCollectionNames) {
    for (const std::string& good :
         {std::string("a"), std::string("9"), std::string("A_b.c-1"), std::string(128, 'x')}) {
        EXPECT_TRUE(checkCollectionName(good)) << good;
    }
    for (const std::string& bad :
         {std::string(), std::string("_a"), std::string(".a"), std::string("-a"), std::string("a b"),
          std::string("a/b"), std::string("é"), std::string(129, 'x'), std::string("a\0b", 3)}) {
        EXPECT_FALSE(checkCollectionName(bad)) << bad;
    }
    EXPECT_EQ(collectionNameOrDefault(""), "default");
    EXPECT_EQ(collectionNameOrDefault("x"), "x");
}

TEST(RequestChecks, AcceptsOnlyValidKeys) {
    for (const std::string& good : {std::string("a"), std::string("folder/file name.ply"),
                                    std::string("ключ 鍵 𝄞"), std::string(512, 'x')}) {
        EXPECT_TRUE(checkKey(good)) << good;
    }
    for (const std::string& bad :
         {std::string(), std::string(513, 'x'), std::string("a\n"), std::string("\x7f"),
          std::string("a\0b", 3), std::string("\xff"), std::string("\xc3")}) {
        EXPECT_FALSE(checkKey(bad)) << bad;
    }
}

TEST(RequestChecks, LimitsMetadata) {
    std::map<std::string, std::string> metadata;
    for (int i = 0; i < 64; ++i) metadata["k" + std::to_string(i)] = std::string(1'024, 'v');
    EXPECT_TRUE(checkMetadata(metadata));
    metadata["one more"] = "";
    EXPECT_FALSE(checkMetadata(metadata));
    EXPECT_TRUE(checkMetadata({{std::string(128, 'k'), ""}, {"a.b-c_D9", "any text, é\n"}}));
    EXPECT_FALSE(checkMetadata({{"", "v"}}));
    EXPECT_FALSE(checkMetadata({{"a b", "v"}}));
    EXPECT_FALSE(checkMetadata({{std::string(129, 'k'), "v"}}));
    EXPECT_FALSE(checkMetadata({{"k", std::string(1'025, 'v')}}));
    EXPECT_FALSE(checkMetadata({{"k", "\xed\xa0\x80"}})) << "a surrogate";
}

TEST(RequestChecks, LimitsWhatAChangeOfMetadataRemoves) {
    store::MetadataChange change;
    for (std::size_t i = 0; i < kMaxMetadataEntries; ++i) change.remove.push_back("k" + std::to_string(i));
    EXPECT_TRUE(checkMetadataChange(change));
    change.remove.emplace_back("one-more");
    const auto many = checkMetadataChange(change);
    ASSERT_FALSE(many);
    EXPECT_EQ(many.error().code, ErrorCode::kInvalidArgument);
    EXPECT_EQ(many.error().message, "remove: 65 keys, at most 64 are allowed");

    change.remove = {std::string(kMaxMetadataKeyBytes, 'k')};
    EXPECT_TRUE(checkMetadataChange(change));
    change.remove = {std::string(kMaxMetadataKeyBytes + 1, 'k')};
    EXPECT_EQ(checkMetadataChange(change).error().code, ErrorCode::kInvalidArgument);
}

TEST(RequestChecks, LimitsGroups) {
    EXPECT_TRUE(checkGrouping("", 0, 10, 10));
    EXPECT_FALSE(checkGrouping("", 1, 10, 10)) << "hits of no group";
    EXPECT_TRUE(checkGrouping("label", 0, 10, 10));
    EXPECT_TRUE(checkGrouping("label", 1, 10, 10));
    EXPECT_FALSE(checkGrouping("label", 2, 10, 10)) << "20 hits";
    EXPECT_TRUE(checkGrouping("label", 100, 1, 100));
    EXPECT_FALSE(checkGrouping("label", 101, 1, 1'000));
    EXPECT_FALSE(checkGrouping("label", 4'294'967'295u, 4'294'967'295u, 10));
    EXPECT_FALSE(checkGrouping("a b", 1, 1, 10));
}

TEST(RequestChecks, LimitsNumbersAndTexts) {
    EXPECT_FALSE(checkK(0, 10));
    EXPECT_TRUE(checkK(1, 10));
    EXPECT_TRUE(checkK(10, 10));
    EXPECT_FALSE(checkK(11, 10));
    EXPECT_FALSE(checkBatchSize(0, 10));
    EXPECT_TRUE(checkBatchSize(10, 10));
    EXPECT_FALSE(checkBatchSize(11, 10));
    for (const double good : {0.0, 0.5, 1.0}) EXPECT_TRUE(checkThreshold(good));
    for (const double bad : {-1e-9, 1.0000001, std::nan(""), HUGE_VAL}) EXPECT_FALSE(checkThreshold(bad));
    EXPECT_TRUE(checkPageSize(0));
    EXPECT_TRUE(checkPageSize(1'000));
    EXPECT_FALSE(checkPageSize(1'001));
    EXPECT_TRUE(checkFilterLength(std::string(kMaxFilterBytes, 'a')));
    EXPECT_EQ(checkFilterLength(std::string(kMaxFilterBytes + 1, 'a')).error().code,
              ErrorCode::kMalformedFilter);
    EXPECT_TRUE(checkDescription(std::string(1'024, 'd')));
    EXPECT_FALSE(checkDescription(std::string(1'025, 'd')));
}

// Encodes every code point; exactly the valid ones must pass.
TEST(RequestChecks, LimitsOrigins) {
    const double infinity = std::numeric_limits<double>::infinity();
    const auto refusal = [](const Point3& origin) {
        const auto checked = checkOrigin(origin);
        return checked ? ""
                       : std::string(errorCodeName(checked.error().code)) + " " + checked.error().message;
    };
    EXPECT_EQ(refusal({}), "");
    EXPECT_EQ(refusal({-3.4e38, 3.4e38, 5e-324}), "");
    EXPECT_EQ(refusal({std::nextafter(3.4e38, infinity), 0.0, 0.0}),
              "coordinate_out_of_range origin: x exceeds the largest magnitude 3.4e38");
    EXPECT_EQ(refusal({0.0, -1e300, 0.0}),
              "coordinate_out_of_range origin: y exceeds the largest magnitude 3.4e38");
    EXPECT_EQ(refusal({0.0, 0.0, -infinity}), "non_finite_coordinate origin: z is infinite");
    EXPECT_EQ(refusal({0.0, std::nan(""), 0.0}), "non_finite_coordinate origin: y is NaN");
}

TEST(IsUtf8, AcceptsExactlyTheValidCodePoints) {
    const auto encode = [](std::uint32_t code) {
        std::string text;
        const auto tail = [&](int shift) { text += static_cast<char>(0x80 | ((code >> shift) & 0x3f)); };
        if (code < 0x80) {
            text += static_cast<char>(code);
        } else if (code < 0x800) {
            text += static_cast<char>(0xc0 | (code >> 6));
            tail(0);
        } else if (code < 0x10000) {
            text += static_cast<char>(0xe0 | (code >> 12));
            tail(6), tail(0);
        } else {
            text += static_cast<char>(0xf0 | (code >> 18));
            tail(12), tail(6), tail(0);
        }
        return text;
    };
    for (std::uint32_t code = 0; code < 0x120000; ++code) {
        const bool valid = code <= 0x10ffff && (code < 0xd800 || code > 0xdfff);
        const std::string text = encode(code);
        ASSERT_EQ(isUtf8("a" + text + "b"), valid) << std::hex << code;
        if (text.size() > 1) {
            ASSERT_FALSE(isUtf8(text.substr(0, text.size() - 1))) << std::hex << code;
            ASSERT_FALSE(isUtf8(text.substr(1))) << std::hex << code;
        }
    }
    for (const char* overlong :
         {"\xc0\x80", "\xc1\xbf", "\xe0\x80\x80", "\xe0\x9f\xbf", "\xf0\x8f\xbf\xbf"}) {
        EXPECT_FALSE(isUtf8(overlong));
    }
}

}  // namespace
}  // namespace shapedb::catalog
