// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/views/views_codec.h"

#include <cstring>
#include <limits>
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "core/synthetic/families.h"
#include "tests/core/signature/forged_bytes.h"

namespace shapedb {
namespace {

ViewSet small() {
    ViewSet set;
    for (std::size_t v = 0; v < kViews; ++v) {
        for (std::size_t i = 0; i < kViewBytes; ++i) {
            set.views[v].levels[i] = static_cast<std::uint8_t>(7 * i + 13 * v);
        }
        set.views[v].size = 0.5f * static_cast<float>(v);
    }
    return set;
}

template <typename T>
std::string forged(std::string bytes, std::size_t at, const T& value) {
    std::memcpy(&bytes[at], &value, sizeof value);
    return testing_support::withChecksum(std::move(bytes));
}

void expectRefused(const std::string& bytes, ErrorCode code, const std::string& why) {
    const auto decoded = decodeViews(bytes);
    ASSERT_FALSE(decoded) << why;
    EXPECT_EQ(decoded.error().code, code) << decoded.error().message;
    EXPECT_NE(decoded.error().message.find(why), std::string::npos) << decoded.error().message;
}

// Version 1. Never edit: stored shapes have these bytes.
TEST(ViewsCodec, WritesTheGoldenBytes) {
    const std::string bytes = encodeViews(small());
    ASSERT_EQ(bytes.size(), 1372u);
    EXPECT_EQ(testing_support::toHex(bytes.substr(0, 8)),
              "53444256"  // SDBV
              "01"        // version
              "14"        // views
              "0000");    // reserved
    EXPECT_EQ(
        testing_support::toHex(bytes.substr(8 + 68, 68)),
        "0d141b222930373e454c535a61686f767d848b9299a0a7aeb5bcc3cad1d8dfe6edf4fb020910171e252c333a41484f56"
        "5d646b727980878e959ca3aab1b8bfc6"
        "0000003f");                                                                // size
    EXPECT_EQ(testing_support::toHex(bytes.substr(bytes.size() - 4)), "a0f36180");  // CRC-32 of all before
}

TEST(ViewsCodec, KeepsAShapeToTheLastBit) {
    EXPECT_EQ(*decodeViews(encodeViews(small())), small());
    const PointCloud points = *scanOf(*makeMember("chair", 0, 1), {});
    const auto set = makeViews(*makeSurfacePoints(points), points);
    ASSERT_TRUE(set);
    EXPECT_EQ(*decodeViews(encodeViews(*set)), *set);
}

TEST(ViewsCodec, RefusesEveryTruncationAndEveryFlippedBit) {
    const std::string bytes = encodeViews(small());
    for (std::size_t n = 0; n < bytes.size(); ++n) EXPECT_FALSE(decodeViews(bytes.substr(0, n))) << n;
    EXPECT_FALSE(decodeViews(bytes + '\0'));
    for (std::size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
        std::string bad = bytes;
        bad[bit / 8] = static_cast<char>(bad[bit / 8] ^ (1 << (bit % 8)));
        EXPECT_FALSE(decodeViews(bad)) << bit;
    }
}

TEST(ViewsCodec, SaysWhatIsWrong) {
    const std::string bytes = encodeViews(small());
    expectRefused("", ErrorCode::kDataLoss, "only 0 bytes");
    expectRefused(forged(bytes, 0, 'X'), ErrorCode::kDataLoss, "SDBV");
    expectRefused(forged(bytes, 4, std::uint8_t{0}), ErrorCode::kDataLoss, "version 0");
    expectRefused(forged(bytes, 4, std::uint8_t{2}), ErrorCode::kSchemaTooNew, "version 2");
    expectRefused(forged(bytes, 5, std::uint8_t{12}), ErrorCode::kDataLoss, "12 views");
    expectRefused(forged(bytes, 6, std::uint8_t{1}), ErrorCode::kDataLoss, "reserved");
    expectRefused(bytes.substr(0, 100), ErrorCode::kDataLoss, "100 bytes instead of 1372");
    for (const float bad : {std::numeric_limits<float>::quiet_NaN(), -1.0f, INFINITY}) {
        expectRefused(forged(bytes, 8 + kViewBytes, bad), ErrorCode::kDataLoss, "size");
    }
    std::string flipped = bytes;
    flipped.back() = static_cast<char>(flipped.back() ^ 1);
    expectRefused(flipped, ErrorCode::kDataLoss, "checksum");
}

}  // namespace
}  // namespace shapedb
