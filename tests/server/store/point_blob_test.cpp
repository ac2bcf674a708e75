// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/store/point_blob.h"

#include <cmath>
#include <cstring>
#include <limits>

#include <gtest/gtest.h>
#include <zstd.h>

#include "core/base/random.h"

namespace shapedb::store {
namespace {

std::string bytes(std::initializer_list<int> values) {
    std::string text;
    for (const int value : values) text.push_back(static_cast<char>(value));
    return text;
}

bool sameBits(const std::vector<float>& a, const std::vector<float>& b) {
    return a.size() == b.size() && (a.empty() || std::memcmp(a.data(), b.data(), 4 * a.size()) == 0);
}

/// A smooth surface with noise, in scanning order: what the format is made for.
std::vector<float> scan(std::size_t points) {
    Random random(3);
    std::vector<float> xyz;
    for (std::size_t i = 0; i < points; ++i) {
        const double u = 6.28 * static_cast<double>(i % 300) / 300.0;
        const double v = 3.14 * static_cast<double>(i) / static_cast<double>(points);
        for (const double c : {std::cos(u) * std::sin(v), std::sin(u) * std::sin(v), std::cos(v)}) {
            xyz.push_back(static_cast<float>(c + 0.001 * random.normal()));
        }
    }
    return xyz;
}

// The bytes of format 0 are frozen.
TEST(PointBlob, RawFormatIsPinned) {
    const std::vector<float> points = {1.0f, -2.0f, 0.5f};
    const std::string blob =
        bytes({0x00, 0x00, 0x00, 0x80, 0x3f, 0x00, 0x00, 0x00, 0xc0, 0x00, 0x00, 0x00, 0x3f});
    EXPECT_EQ(encodePoints(points, 1).value(), blob);  // too short for zstd to gain
    EXPECT_EQ(decodePoints(blob.data(), blob.size(), 3).value(), points);
    EXPECT_EQ(encodePoints({}, 1).value(), bytes({0x00}));
}

// The bytes of format 1 are frozen: a zstd frame (RFC 8878) with one raw block, written by
// hand, of the twelve planes of (1, -2, 0.5) and (2, 4, -1).
TEST(PointBlob, PlanesFormatIsPinned) {
    const std::string head = bytes({0x01,                    // format
                                    0x28, 0xb5, 0x2f, 0xfd,  // zstd magic
                                    0x20, 0x18,              // single segment, 24 bytes
                                    0xc1, 0x00, 0x00});      // last block, raw, 24 bytes
    const std::string x = bytes({0x00, 0x00, 0x00, 0x00, 0x80, 0x00, 0x3f, 0x40});
    const std::string y = bytes({0x00, 0x00, 0x00, 0x00, 0x00, 0x80, 0xc0, 0x40});
    const std::string z = bytes({0x00, 0x00, 0x00, 0x00, 0x00, 0x80, 0x3f, 0xbf});
    const std::string blob = head + x + y + z;
    const auto points = decodePoints(blob.data(), blob.size(), 6);
    ASSERT_TRUE(points) << points.error().message;
    EXPECT_EQ(*points, (std::vector<float>{1.0f, -2.0f, 0.5f, 2.0f, 4.0f, -1.0f}));
}

TEST(PointBlob, PlanesAreATransposition) {
    const std::string in = "abcdefghijklABCDEFGHIJKL";
    std::string planes(24, ' ');
    std::string back(24, ' ');
    const auto* from = reinterpret_cast<const unsigned char*>(in.data());
    auto* middle = reinterpret_cast<unsigned char*>(planes.data());
    bytesToPlanes(from, middle, 2);
    EXPECT_EQ(planes, "aAbBcCdDeEfFgGhHiIjJkKlL");
    planesToBytes(middle, reinterpret_cast<unsigned char*>(back.data()), 2);
    EXPECT_EQ(back, in);
}

TEST(PointBlob, KeepsEveryBit) {
    Random random(11);
    for (int round = 0; round < 200; ++round) {
        std::vector<float> points(3 * random.below(300));
        for (float& value : points) {
            const auto bits = static_cast<std::uint32_t>(random.next());
            std::memcpy(&value, &bits, 4);  // NaN payloads, infinities, denormals
        }
        const auto blob = encodePoints(points, 1 + static_cast<int>(random.below(19)));
        ASSERT_TRUE(blob);
        const auto back = decodePoints(blob->data(), blob->size(), points.size());
        ASSERT_TRUE(back) << back.error().message;
        EXPECT_TRUE(sameBits(points, *back));
    }
}

TEST(PointBlob, PlanesCompressBetter) {
    const std::vector<float> points = scan(20000);
    const std::size_t raw = 4 * points.size();
    std::string plain(ZSTD_compressBound(raw), ' ');
    plain.resize(ZSTD_compress(plain.data(), plain.size(), points.data(), raw, 1));
    const std::string blob = encodePoints(points, 1).value();
    EXPECT_EQ(blob[0], 1);
    EXPECT_LT(static_cast<double>(blob.size()), 0.9 * static_cast<double>(raw));
    EXPECT_LT(static_cast<double>(blob.size()), 0.95 * static_cast<double>(plain.size()));
}

TEST(PointBlob, IncompressibleStaysRaw) {
    Random random(5);
    std::vector<float> points(3000);
    for (float& value : points) {
        const auto bits = static_cast<std::uint32_t>(random.next());
        std::memcpy(&value, &bits, 4);
    }
    const std::string blob = encodePoints(points, 1).value();
    EXPECT_EQ(blob[0], 0);
    EXPECT_EQ(blob.size(), 1 + 4 * points.size());
}

std::string written(const PointEncoding& encoding) {
    std::string blob;
    encoding.write(
        [&](const void* data, std::size_t size) { blob.append(static_cast<const char*>(data), size); });
    return blob;
}

// More than one piece, and not a whole number of pieces.
constexpr std::size_t kLargePoints = PointEncoding::kWholeBytes / 12 + 1'001;

TEST(PointEncoding, KeepsASmallScanAsOneBlob) {
    const std::vector<float> points = scan(500);
    const auto encoding = PointEncoding::encode(points, 1);
    ASSERT_TRUE(encoding);
    ASSERT_NE(encoding->whole(), nullptr);
    EXPECT_EQ(*encoding->whole(), encodePoints(points, 1).value());
    EXPECT_EQ(written(*encoding), *encoding->whole());
    EXPECT_EQ(encoding->size(), encoding->whole()->size());
}

TEST(PointEncoding, WritesALargeScanInPieces) {
    const std::vector<float> points = scan(kLargePoints);
    for (const int level : {1, 3}) {
        const auto encoding = PointEncoding::encode(points, level);
        ASSERT_TRUE(encoding);
        EXPECT_EQ(encoding->whole(), nullptr);
        const std::string blob = written(*encoding);
        EXPECT_EQ(blob.size(), encoding->size());
        EXPECT_EQ(blob[0], 1);
        EXPECT_LT(blob.size(), 4 * points.size());
        const auto back = decodePoints(blob.data(), blob.size(), points.size());
        ASSERT_TRUE(back) << back.error().message;
        EXPECT_TRUE(sameBits(points, *back));
    }
}

TEST(PointEncoding, KeepsALargeScanRawWhenCompressionDoesNotPay) {
    Random random(5);
    std::vector<float> points(3 * kLargePoints);
    for (float& value : points) {
        const auto bits = static_cast<std::uint32_t>(random.next());
        std::memcpy(&value, &bits, 4);
    }
    const auto encoding = PointEncoding::encode(points, 1);
    ASSERT_TRUE(encoding);
    const std::string blob = written(*encoding);
    EXPECT_EQ(blob.size(), 1 + 4 * points.size());
    EXPECT_EQ(encoding->size(), blob.size());
    EXPECT_EQ(blob[0], 0);
    EXPECT_TRUE(sameBits(points, decodePoints(blob.data(), blob.size(), points.size()).value()));
}

TEST(PointBlob, DamageIsAnErrorOrHarmless) {
    const std::vector<float> points = scan(500);
    const std::string blob = encodePoints(points, 1).value();
    Random random(17);
    for (int round = 0; round < 3000; ++round) {
        std::string damaged = blob;
        if (round % 3 == 0) {
            damaged.resize(random.below(damaged.size()));
        } else {
            damaged[random.below(damaged.size())] ^= static_cast<char>(1u << random.below(8));
        }
        const auto decoded = decodePoints(damaged.data(), damaged.size(), points.size());
        // The content may differ: the checksum of the shape detects that.
        EXPECT_TRUE(!decoded || decoded->size() == points.size());
    }
}

TEST(PointBlob, WrongSizesAllocateNothing) {
    const std::vector<float> points = scan(500);
    const std::string blob = encodePoints(points, 1).value();
    for (const std::uint64_t count : {std::uint64_t{0}, std::uint64_t{1499}, std::uint64_t{1501},
                                      std::numeric_limits<std::uint64_t>::max() / 4}) {
        const auto decoded = decodePoints(blob.data(), blob.size(), count);
        ASSERT_FALSE(decoded);
        EXPECT_EQ(decoded.error().code, ErrorCode::kDataLoss);
    }
    // A frame that announces 2^40 bytes.
    const std::string lie =
        bytes({0x01, 0x28, 0xb5, 0x2f, 0xfd, 0xe0, 0, 0, 0, 0, 0, 1, 0, 0, 0x01, 0x00, 0x00});
    EXPECT_EQ(decodePoints(lie.data(), lie.size(), 1500).error().code, ErrorCode::kDataLoss);
}

TEST(PointBlob, RefusesUnknownFormats) {
    const std::string blob = bytes({0x02, 0, 0, 0, 0});
    EXPECT_EQ(decodePoints(blob.data(), blob.size(), 1).error().code, ErrorCode::kSchemaTooNew);
    EXPECT_EQ(decodePoints("", 0, 0).error().code, ErrorCode::kDataLoss);
}

}  // namespace
}  // namespace shapedb::store
