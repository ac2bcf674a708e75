// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/fit/surface_points_codec.h"

#include <cstring>
#include <limits>
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "core/synthetic/families.h"
#include "tests/core/signature/forged_bytes.h"

namespace shapedb {
namespace {

SurfacePoints small() {
    SurfacePoints surface;
    surface.centre = {1.5, -2.0, 0.25};
    surface.unit = 0.5;
    surface.points = {{{-32767, 0, 1}, {127, 0}},
                      {{32767, 2, -3}, {-127, 5}},
                      {{100, -32767, 300}, {0, -1}},
                      {{-258, 32767, 4}, {0, 0}},
                      {{7, 8, 9}, {64, -64}}};
    return surface;
}

std::string fromHex(const std::string& hex) {
    std::string bytes;
    for (std::size_t i = 0; i + 1 < hex.size(); i += 2) {
        bytes.push_back(static_cast<char>(std::stoi(hex.substr(i, 2), nullptr, 16)));
    }
    return bytes;
}

// Version 1, byte by byte. Never edit: stored shapes have these bytes.
const char* const kGolden =
    "53444246"          // SDBF
    "01"                // version
    "00"                // reserved
    "0500"              // points
    "000000000000f83f"  // centre
    "00000000000000c0"
    "000000000000d03f"
    "000000000000e03f"  // unit
    "0180000001007f00"
    "ff7f0200fdff8105"
    "640001802c0100ff"
    "fefeff7f04000000"
    "07000800090040c0"
    "1a60fc47";  // CRC-32 of all before

// `bytes` with `value` at `at`, and the checksum that belongs to it.
template <typename T>
std::string forged(std::string bytes, std::size_t at, const T& value) {
    std::memcpy(&bytes[at], &value, sizeof value);
    return testing_support::withChecksum(std::move(bytes));
}

void expectRefused(const std::string& bytes, ErrorCode code, const std::string& why) {
    const auto decoded = decodeSurfacePoints(bytes);
    ASSERT_FALSE(decoded) << why;
    EXPECT_EQ(decoded.error().code, code) << decoded.error().message;
    EXPECT_NE(decoded.error().message.find(why), std::string::npos) << decoded.error().message;
}

TEST(SurfacePointsCodec, WritesTheGoldenBytes) {
    EXPECT_EQ(testing_support::toHex(encodeSurfacePoints(small())), kGolden);
}

TEST(SurfacePointsCodec, ReadsTheGoldenBytes) {
    const auto decoded = decodeSurfacePoints(fromHex(kGolden));
    ASSERT_TRUE(decoded) << decoded.error().message;
    EXPECT_EQ(decoded->points, small().points);
    EXPECT_EQ(decoded->centre, small().centre);
    EXPECT_EQ(decoded->unit, small().unit);
}

TEST(SurfacePointsCodec, KeepsAScanToTheLastBit) {
    const auto member = makeMember("chair", 0, 1);
    ASSERT_TRUE(member);
    const auto surface = makeSurfacePoints(*scanOf(*member, {}));
    ASSERT_TRUE(surface);
    const std::string bytes = encodeSurfacePoints(*surface);
    EXPECT_EQ(bytes.size(), 44 + 8 * surface->size());
    const auto decoded = decodeSurfacePoints(bytes);
    ASSERT_TRUE(decoded) << decoded.error().message;
    EXPECT_EQ(decoded->points, surface->points);
    EXPECT_EQ(decoded->centre, surface->centre);
    EXPECT_EQ(decoded->unit, surface->unit);
}

TEST(SurfacePointsCodec, RefusesEveryTruncationAndEveryFlippedBit) {
    const std::string bytes = encodeSurfacePoints(small());
    for (std::size_t n = 0; n < bytes.size(); ++n) EXPECT_FALSE(decodeSurfacePoints(bytes.substr(0, n))) << n;
    EXPECT_FALSE(decodeSurfacePoints(bytes + '\0'));
    for (std::size_t bit = 0; bit < 8 * bytes.size(); ++bit) {
        std::string bad = bytes;
        bad[bit / 8] = static_cast<char>(bad[bit / 8] ^ (1 << (bit % 8)));
        EXPECT_FALSE(decodeSurfacePoints(bad)) << bit;
    }
}

TEST(SurfacePointsCodec, SaysWhatIsWrong) {
    const std::string bytes = encodeSurfacePoints(small());
    expectRefused("", ErrorCode::kDataLoss, "only 0 bytes");
    expectRefused(forged(bytes, 0, 'X'), ErrorCode::kDataLoss, "SDBF");
    expectRefused(forged(bytes, 4, std::uint8_t{0}), ErrorCode::kDataLoss, "version 0");
    expectRefused(forged(bytes, 4, std::uint8_t{2}), ErrorCode::kSchemaTooNew, "version 2");
    expectRefused(forged(bytes, 5, std::uint8_t{1}), ErrorCode::kDataLoss, "reserved");
    expectRefused(forged(bytes, 6, std::uint16_t{3}), ErrorCode::kDataLoss, "3 points");
    expectRefused(forged(bytes, 6, std::uint16_t{65535}), ErrorCode::kDataLoss, "65535 points");
    expectRefused(forged(bytes, 6, std::uint16_t{6}), ErrorCode::kDataLoss, "84 bytes instead of 92");
    for (const double bad : {std::numeric_limits<double>::quiet_NaN(), 1e39, -1e300}) {
        expectRefused(forged(bytes, 8, bad), ErrorCode::kDataLoss, "centre");
    }
    for (const double bad : {std::numeric_limits<double>::quiet_NaN(), 0.0, -1.0, 1e40, 1e-50}) {
        expectRefused(forged(bytes, 32, bad), ErrorCode::kDataLoss, "unit");
    }
    expectRefused(forged(bytes, 42, std::int16_t{-32768}), ErrorCode::kDataLoss, "coordinate of point 0");
    expectRefused(forged(bytes, 46, std::int8_t{-128}), ErrorCode::kDataLoss, "normal of point 0");
    SurfacePoints shrunk = small();
    for (auto& p : shrunk.points) {
        for (auto& v : p.position) v = static_cast<std::int16_t>(v / 2);
    }
    expectRefused(encodeSurfacePoints(shrunk), ErrorCode::kDataLoss, "fill their frame");
    std::string flipped = bytes;
    flipped.back() = static_cast<char>(flipped.back() ^ 1);
    expectRefused(flipped, ErrorCode::kDataLoss, "checksum");
}

}  // namespace
}  // namespace shapedb
