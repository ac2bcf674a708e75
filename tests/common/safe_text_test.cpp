// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/safe_text.h"

#include <cstdint>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace shapedb {
namespace {

std::string utf8(std::uint32_t code) {
    if (code < 0x80) return {static_cast<char>(code)};
    if (code < 0x800) return {static_cast<char>(0xc0 | (code >> 6)), static_cast<char>(0x80 | (code & 0x3f))};
    return {static_cast<char>(0xe0 | (code >> 12)), static_cast<char>(0x80 | ((code >> 6) & 0x3f)),
            static_cast<char>(0x80 | (code & 0x3f))};
}

std::vector<std::uint32_t> unsafeCodes() {
    std::vector<std::uint32_t> codes;
    for (std::uint32_t c = 0; c < 0x20; ++c) codes.push_back(c);
    for (std::uint32_t c = 0x7f; c < 0xa0; ++c) codes.push_back(c);
    // Left-to-right and right-to-left marks, embeddings, overrides and isolates; separators; a byte order
    // mark.
    for (const std::uint32_t c : {0x61cu, 0x200eu, 0x200fu, 0x202au, 0x202bu, 0x202cu, 0x202du, 0x202eu,
                                  0x2066u, 0x2067u, 0x2068u, 0x2069u, 0x2028u, 0x2029u, 0xfeffu, 0x200bu}) {
        codes.push_back(c);
    }
    return codes;
}

TEST(SafeText, FindsEveryControlCharacterAndDirectionMark) {
    for (const std::uint32_t code : unsafeCodes()) {
        const std::string text = "caf\xc3\xa9 " + utf8(code) + "x";
        EXPECT_EQ(findUnsafe(text), 6u) << std::hex << code;
        const std::string safe = escapeUnsafe(text);
        EXPECT_EQ(findUnsafe(safe), std::string::npos) << std::hex << code;
        char expected[16];
        std::snprintf(expected, sizeof expected, "\\u%04x", static_cast<unsigned>(code));
        EXPECT_EQ(safe, std::string("caf\xc3\xa9 ") + expected + "x");
    }
}

TEST(SafeText, LeavesWritingOfAllKindsAlone) {
    for (const std::string text : {"", "plain", "Schr\xc3\xa4nke", "\xe5\xb1\xb1/\xe5\xb7\x9d",
                                   "\xd7\xa9\xd7\x9c\xd7\x95\xd7\x9d", "\xf0\x9f\x98\x80",
                                   // Persian with a zero width non-joiner.
                                   "\xd9\x85\xdb\x8c\xe2\x80\x8c\xd8\xae", "back\\slash \"quoted\""}) {
        EXPECT_EQ(findUnsafe(text), std::string::npos) << text;
        EXPECT_EQ(escapeUnsafe(text), text);
    }
}

TEST(SafeText, BytesThatAreNoUtf8AreReplaced) {
    for (const std::string bad : {"\xff", "\xc3", "\xc0\xaf", "\xed\xa0\x80", "\x9b"}) {
        EXPECT_FALSE(isUtf8(bad));
        EXPECT_EQ(findUnsafe("ab" + bad), 2u);
        EXPECT_EQ(isUtf8(escapeUnsafe(bad)), true);
    }
    EXPECT_EQ(escapeUnsafe("\x9b"
                           "2J"),
              "\\ufffd2J");
}

TEST(SafeText, KeepsLineFeedsOnlyWhereAsked) {
    EXPECT_EQ(escapeUnsafe("a\nb\r\n", true), "a\nb\\u000d\n");
    EXPECT_EQ(escapeUnsafe("a\nb"), "a\\u000ab");
}

}  // namespace
}  // namespace shapedb
