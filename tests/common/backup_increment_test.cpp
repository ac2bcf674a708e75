// SPDX-License-Identifier: GPL-3.0-or-later
#include "common/backup_increment.h"

#include <string>

#include <gtest/gtest.h>

namespace shapedb {
namespace {

IncrementHead someHead() {
    IncrementHead head;
    head.base.bytes = 0x3000;
    head.base.sha256.fill(0xba);
    head.result.backup.bytes = 0x5000;
    head.result.backup.sha256.fill(0xc5);
    head.result.blockBytes = 0x2000;
    head.result.blocks.resize(3);
    for (std::size_t i = 0; i < 3; ++i) head.result.blocks[i].fill(static_cast<std::uint8_t>(i + 1));
    head.changed = {1, 2};
    return head;
}

std::string times(int count, const std::string& text) {
    std::string all;
    for (int i = 0; i < count; ++i) all += text;
    return all;
}

// Literal bytes: increments that were written once stay readable.
TEST(BackupIncrement, VersionOneHasTheseBytes) {
    const std::string text = encodeIncrementHead(someHead());
    ASSERT_EQ(text.size(), kIncrementPrefixBytes + 3 * 32 + 2 * 4 + 32);
    const std::string checksum = text.substr(text.size() - 32);
    const std::string fields =
        "53684442696e6372"
        "01000000"
        "02000000"
        "0030000000000000" +
        times(32, "ba") + "0050000000000000" + times(32, "c5") + "0020000000000000" + times(32, "01") +
        times(32, "02") + times(32, "03") + "01000000" + "02000000";
    EXPECT_EQ(toHex(text.data(), text.size() - 32), fields);
    EXPECT_EQ(toHex(checksum.data(), 32), "358db94676f73af6248012eb8b0ce6ea937114917e6ed48cc1d6ca07525262a2");

    const std::uint64_t fileBytes = text.size() + 0x2000 + 0x1000;
    EXPECT_EQ(changedBytes(someHead()), 0x3000u);
    EXPECT_EQ(incrementHeadBytes(text.substr(0, kIncrementPrefixBytes), fileBytes).value(), text.size());
    const auto head = decodeIncrementHead(text, fileBytes);
    ASSERT_TRUE(head) << head.error().message;
    EXPECT_EQ(encodeIncrementHead(*head), text);
}

TEST(BackupIncrement, OtherVersionsAreNamed) {
    std::string text = encodeIncrementHead(someHead());
    text[8] = 2;
    const auto refused = incrementHeadBytes(text, 1 << 20);
    ASSERT_FALSE(refused);
    EXPECT_NE(refused.error().message.find("of version 2, this program reads 1: update it"),
              std::string::npos)
        << refused.error().message;
    EXPECT_FALSE(looksLikeIncrement("ShDBinc"));
    EXPECT_FALSE(looksLikeIncrement(""));
    EXPECT_FALSE(incrementHeadBytes("", 0));
}

}  // namespace
}  // namespace shapedb
