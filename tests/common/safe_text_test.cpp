// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/safe_text.h"

#include <cstdint>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "common/api_key_text.h"

namespace shapedb {

namespace {

std::string utf8(std::uint32_t code) {
    if (code < 0x80) return {static_cast<char>(code)};
    if (code < 0x800) return {static_cast<char>(0xc0 | (code >> 6)), static_cast<char>(0x80 | (code & 0x3f))};
    const auto rest = [&](int shift) { return static_cast<char>(0x80 | ((code >> shift) & 0x3f)); };
    if (code < 0x10000) return {static_cast<char>(0xe0 | (code >> 12)), rest(6), rest(0)};
    return {static_cast<char>(0xf0 | (code >> 18)), rest(12), rest(6), rest(0)};
}

std::vector<std::uint32_t> unsafeCodes() {
    std::vector<std::uint32_t> codes;
    for (std::uint32_t c = 0; c < 0x20; ++c) codes.push_back(c);
    for (std::uint32_t c = 0x7f; c < 0xa0; ++c) codes.push_back(c);
    // Of Unicode: format characters and what is shown as nothing, those at the ends of each range.
    for (const std::uint32_t c :
         {0xadu,    0x34fu,   0x600u,   0x605u,   0x61cu,   0x6ddu,   0x70fu,   0x890u,   0x8e2u,
          0x115fu,  0x1160u,  0x17b4u,  0x17b5u,  0x180bu,  0x180eu,  0x180fu,  0x200bu,  0x200cu,
          0x200du,  0x200eu,  0x200fu,  0x2028u,  0x2029u,  0x202au,  0x202eu,  0x2060u,  0x2065u,
          0x2066u,  0x2069u,  0x206fu,  0x3164u,  0xfe00u,  0xfe0fu,  0xfeffu,  0xffa0u,  0xfff0u,
          0xfff8u,  0xfff9u,  0xfffbu,  0x110bdu, 0x110cdu, 0x13430u, 0x1343fu, 0x1bca0u, 0x1bca3u,
          0x1d173u, 0x1d17au, 0xe0000u, 0xe0001u, 0xe0020u, 0xe007fu, 0xe0100u, 0xe01efu, 0xe0fffu}) {
        codes.push_back(c);
    }
    return codes;
}

TEST(SafeText, FindsEveryCharacterOfControlOrFormatAndEachThatIsShownAsNothing) {
    for (const std::uint32_t code : unsafeCodes()) {
        const std::string text = "caf\xc3\xa9 " + utf8(code) + "x";
        EXPECT_EQ(findUnsafe(text), 6u) << std::hex << code;
        const std::string safe = escapeUnsafe(text);
        EXPECT_EQ(findUnsafe(safe), std::string::npos) << std::hex << code;
        char expected[16];
        if (code < 0x10000) {
            std::snprintf(expected, sizeof expected, "\\u%04x", static_cast<unsigned>(code));
        } else {
            std::snprintf(expected, sizeof expected, "\\u%04x\\u%04x", (0xd7c0u + (code >> 10)),
                          0xdc00u | (code & 0x3ffu));
        }
        EXPECT_EQ(safe, std::string("caf\xc3\xa9 ") + expected + "x");
    }
}

TEST(SafeText, LeavesWritingOfAllKindsAlone) {
    for (const std::string text : {"", "plain", "Schr\xc3\xa4nke", "\xe5\xb1\xb1/\xe5\xb7\x9d",
                                   "\xd7\xa9\xd7\x9c\xd7\x95\xd7\x9d", "\xf0\x9f\x98\x80",
                                   "\xd9\x85\xdb\x8c\xd8\xae",  // Persian
                                   "back\\slash \"quoted\""}) {
        EXPECT_EQ(findUnsafe(text), std::string::npos) << text;
        EXPECT_EQ(escapeUnsafe(text), text);
    }
}

TEST(SafeText, LeavesTheNeighboursAlone) {
    for (const std::uint32_t code :
         {0x20u,    0x7eu,    0xa0u,    0xacu,    0xaeu,    0x34eu,   0x350u,   0x5ffu,  0x606u,  0x115eu,
          0x1161u,  0x180au,  0x1810u,  0x200au,  0x2010u,  0x2027u,  0x202fu,  0x205fu, 0x2070u, 0x3163u,
          0x3165u,  0xfdffu,  0xfe10u,  0xfefeu,  0xff00u,  0xff9fu,  0xffa1u,  0xffefu, 0xfffcu, 0x1342fu,
          0x13440u, 0x1d172u, 0x1d17bu, 0x1f600u, 0xdffffu, 0xe1000u, 0x10ffffu}) {
        EXPECT_EQ(findUnsafe(utf8(code)), std::string::npos) << std::hex << code;
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

namespace {

const std::string kPublic = "shapedb_0123456789abcdef_";
const std::string kSecret(kApiKeySecretDigits, 'a');

TEST(MaskSecrets, LeavesTheIdOfEachKey) {
    EXPECT_EQ(maskSecrets(kPublic + kSecret), kPublic + "***");
    EXPECT_EQ(maskSecrets("key 'x/" + kPublic + kSecret + "' and " + kPublic + kSecret + "."),
              "key 'x/" + kPublic + "***' and " + kPublic + "***.");
    EXPECT_EQ(maskSecrets("shapedb_" + kPublic + kSecret), "shapedb_" + kPublic + "***");
    EXPECT_EQ(maskSecrets("SHAPEDB_0123456789ABCDEF_AB"), "SHAPEDB_0123456789ABCDEF_***");
}

TEST(MaskSecrets, AlsoWhereOnlyAPartOfItIsLeft) {
    for (std::size_t digits = 1; digits <= kSecret.size(); ++digits) {
        EXPECT_EQ(maskSecrets(kPublic + kSecret.substr(0, digits)), kPublic + "***") << digits;
    }
    EXPECT_EQ(maskSecrets(kPublic + kSecret + kSecret + "x"), kPublic + "***x");
}

TEST(MaskSecrets, LeavesOtherTextAlone) {
    for (const std::string& text :
         {std::string(), std::string("shapedb"), std::string("shapedb_"), std::string("shapedb_bones"),
          kPublic, kPublic + "x", kPublic.substr(0, kPublic.size() - 2) + "_" + kSecret,
          std::string("shapedb_0123456789abcdeg_") + kSecret, kSecret}) {
        EXPECT_EQ(maskSecrets(text), text);
    }
}

}  // namespace

}  // namespace shapedb
