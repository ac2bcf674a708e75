// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/http/envelope.h"

#include <gtest/gtest.h>

namespace shapedb::http {
namespace {

std::vector<std::string> readInPieces(const std::string& bytes, std::size_t piece, bool* between = nullptr) {
    EnvelopeReader reader(100);
    std::vector<std::string> messages;
    for (std::size_t at = 0; at < bytes.size(); at += piece) {
        EXPECT_TRUE(reader.add(std::string_view(bytes).substr(at, piece), messages));
    }
    if (between != nullptr) *between = reader.between();
    return messages;
}

TEST(Envelope, HasFlagsAndABigEndianLength) {
    EXPECT_EQ(inEnvelope(kEndOfStream, "{}"), std::string("\x02\0\0\0\x02{}", 7));
    const std::string longer = inEnvelope(kPlainMessage, std::string(0x010203, 'x'));
    EXPECT_EQ(longer.substr(0, 5), std::string("\0\0\x01\x02\x03", 5));
    EXPECT_EQ(longer.size(), 5u + 0x010203u);
}

TEST(Envelope, IsReadHoweverItsBytesArrive) {
    const std::vector<std::string> sent = {"one", "", "three", std::string(100, 'x')};
    std::string bytes;
    for (const std::string& message : sent) bytes += inEnvelope(kPlainMessage, message);
    for (const std::size_t piece : {std::size_t{1}, std::size_t{2}, std::size_t{7}, bytes.size()}) {
        bool between = false;
        EXPECT_EQ(readInPieces(bytes, piece, &between), sent) << piece;
        EXPECT_TRUE(between);
    }
}

TEST(Envelope, ThatIsCutOffIsNoticed) {
    const std::string bytes = inEnvelope(kPlainMessage, "abc");
    for (std::size_t size = 1; size < bytes.size(); ++size) {
        bool between = true;
        EXPECT_TRUE(readInPieces(bytes.substr(0, size), 3, &between).empty());
        EXPECT_FALSE(between) << size;
    }
}

TEST(Envelope, WithOtherFlagsOrTooLongIsRefused) {
    const auto refusal = [](const std::string& bytes) {
        EnvelopeReader reader(100);
        std::vector<std::string> messages;
        const auto added = reader.add(bytes, messages);
        EXPECT_TRUE(messages.empty());
        return added ? Failure{} : added.error();
    };
    const Failure compressed = refusal(inEnvelope(1, "x"));
    EXPECT_EQ(compressed.code, Code::kUnimplemented);
    EXPECT_NE(compressed.message.find("identity"), std::string::npos);
    for (const int flags : {2, 4, 0x80, 0xff}) {
        const Failure failure = refusal(inEnvelope(static_cast<std::uint8_t>(flags), "x"));
        EXPECT_EQ(failure.code, Code::kInvalidArgument) << flags;
        EXPECT_EQ(failure.name, "malformed_stream");
    }
    // Announced, not sent: no memory is taken for it.
    const Failure tooLong = refusal(std::string("\0\xff\xff\xff\xff", 5));
    EXPECT_EQ(tooLong.code, Code::kResourceExhausted);
    EXPECT_NE(tooLong.message.find("4294967295"), std::string::npos);
    EXPECT_EQ(refusal(inEnvelope(kPlainMessage, std::string(101, 'x'))).code, Code::kResourceExhausted);
}

}  // namespace
}  // namespace shapedb::http
