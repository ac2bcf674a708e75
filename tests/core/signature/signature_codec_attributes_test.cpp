// SPDX-License-Identifier: GPL-3.0-or-later
// Versions 2 to 4 of the format: signatures with attributes.
#include <cmath>
#include <cstdint>
#include <string>

#include <gtest/gtest.h>

#include "core/base/random.h"
#include "core/pipeline.h"
#include "core/signature/signature_codec.h"
#include "core/synthetic/families.h"
#include "tests/core/signature/forged_bytes.h"

namespace shapedb {
namespace {

using testing_support::expectMalformed;
using testing_support::withChecksum;

Signature onePoint() {
    Signature signature;
    signature.scale = 2.5;
    signature.origin = {1.0, -2.0, 0.125};
    signature.volume = 3.75;
    signature.points.resize(1);
    signature.points[0] = {
        {0.0f, 0.0f, 0.0f}, 0.125f, 0.125f * 15.625f / 3.75f, 0.25f, {0.01f, 0.0f, 0.0f, 0.02f, 0.0f, 0.03f}};
    ShapeAttributes& attributes = signature.attributes.emplace();
    attributes.quality = 200;
    for (std::size_t i = 0; i < kStatisticBins; ++i) {
        attributes.statistics[i] = (7 * i + 3) % 16;
    }
    attributes.body = bodyOf(signature.points);
    return signature;
}

Signature randomAttributed(Random& random, std::size_t count) {
    Signature signature;
    signature.scale = std::exp(random.uniform(-80, 80));
    signature.volume = signature.scale * signature.scale * signature.scale * random.uniform(1, 100);
    signature.origin = {random.normal() * 1e30, random.normal(), random.normal() * 1e-30};
    for (std::size_t i = 0; i < count; ++i) {
        WeightedPoint point;
        if (i > 0) {
            for (float& v : point.position) v = static_cast<float>(random.normal());
        }
        point.weight = 1.0f / static_cast<float>(i + 1);
        point.volumeShare = volumeShareOf(point.weight, signature.scale, signature.volume);
        point.maximumRadius = static_cast<float>(random.uniform(0.1, 1));
        for (float& v : point.covariance) v = static_cast<float>(random.normal());
        signature.points.push_back(point);
    }
    ShapeAttributes& attributes = signature.attributes.emplace();
    attributes.quality = static_cast<std::uint8_t>(random.below(256));
    for (std::uint8_t& bin : attributes.statistics) bin = static_cast<std::uint8_t>(random.below(16));
    attributes.body = bodyOf(signature.points);
    return signature;
}

void expectSameBody(const Body& a, const Body& b) {
    EXPECT_EQ(a.centre, b.centre);
    EXPECT_EQ(a.axes, b.axes);
    ASSERT_EQ(a.segments.size(), b.segments.size());
    for (std::size_t i = 0; i < a.segments.size(); ++i) {
        EXPECT_EQ(a.segments[i].position, b.segments[i].position);
        EXPECT_EQ(a.segments[i].radius, b.segments[i].radius);
        EXPECT_EQ(a.segments[i].share, b.segments[i].share);
        EXPECT_EQ(a.segments[i].size, b.segments[i].size);
    }
}

// Stored signatures must stay readable: these bytes never change.
std::string goldenHead(const std::string& version) {
    const std::string head = "53444247" +  // SDBG
                             version +
                             "0100"              // one point
                             "c8000000"          // quality 200
                             "0000000000000440"  // scale 2.5
                             "000000000000f03f"
                             "00000000000000c0"
                             "000000000000c03f"          // origin 1, -2, 0.125
                             "0000000000000e40"          // volume 3.75
                             "000000000000000000000000"  // position
                             "0000003e0000803e"  // weight, radius of its largest ball (share: from weight)
                             "0ad7233c00000000000000000ad7a33c000000008fc2f53c";
    std::string bytes;
    for (std::size_t i = 0; i < head.size(); i += 2) {
        bytes.push_back(static_cast<char>(std::stoi(head.substr(i, 2), nullptr, 16)));
    }
    return bytes;
}

// The same, as read from version 3.
Signature onePointOfVersion3() {
    Signature signature = onePoint();
    signature.attributes->earlier = true;
    for (std::size_t i = kEarlierStatisticBins; i < kStatisticBins; ++i) {
        signature.attributes->statistics[i] = 0;
    }
    return signature;
}

TEST(SignatureCodecAttributes, ReadsAndWritesTheGoldenBytes) {
    std::string golden = goldenHead("0400");
    for (int i = 0; i < 448; i += 2) {
        golden.push_back(static_cast<char>((7 * i + 3) % 16 + 16 * ((7 * (i + 1) + 3) % 16)));
    }
    for (const int byte : {0xf5, 0x46, 0x37, 0xb8}) golden.push_back(static_cast<char>(byte));
    EXPECT_EQ(encodeSignature(onePoint()), golden);
    const auto decoded = decodeSignature(golden);
    ASSERT_TRUE(decoded) << decoded.error().message;
    EXPECT_TRUE(sameShape(*decoded, onePoint()));
    EXPECT_FALSE(decoded->attributes->earlier);
    EXPECT_EQ(decoded->attributes->quality, 200);
}

// Version 3 has other inside distances and a statistic less; it stays what it is when written again.
TEST(SignatureCodecAttributes, ReadsAndRewritesGoldenBytesOfVersion3) {
    std::string golden = goldenHead("0300");
    for (int i = 0; i < 432; i += 2) {
        golden.push_back(static_cast<char>((7 * i + 3) % 16 + 16 * ((7 * (i + 1) + 3) % 16)));
    }
    for (const int byte : {0x4c, 0x15, 0xed, 0xb2}) golden.push_back(static_cast<char>(byte));
    EXPECT_EQ(encodeSignature(onePointOfVersion3()), golden);
    const auto decoded = decodeSignature(golden);
    ASSERT_TRUE(decoded) << decoded.error().message;
    EXPECT_TRUE(sameShape(*decoded, onePointOfVersion3()));
    EXPECT_FALSE(sameShape(*decoded, onePoint()));
    EXPECT_TRUE(decoded->attributes->earlier);
    EXPECT_EQ(decoded->attributes->quality, 200);
    EXPECT_FLOAT_EQ(decoded->points[0].volumeShare, 0.5208333f);
}

// Version 2 kept roots in 255 steps; they are read as today's levels.
TEST(SignatureCodecAttributes, ReadsTheGoldenBytesOfVersion2) {
    std::string golden = goldenHead("0200");
    for (int i = 0; i < 432; ++i) golden.push_back(static_cast<char>((7 * i + 3) % 256));
    for (const int byte : {0x7a, 0x99, 0x93, 0xff}) golden.push_back(static_cast<char>(byte));
    const auto decoded = decodeSignature(golden);
    ASSERT_TRUE(decoded) << decoded.error().message;
    EXPECT_EQ(decoded->attributes->quality, 200);
    EXPECT_EQ(decoded->attributes->statistics[0], 0);    // 3/255
    EXPECT_EQ(decoded->attributes->statistics[5], 3);    // 38/255: 3.16
    EXPECT_EQ(decoded->attributes->statistics[17], 10);  // 122/255: 10.15
    EXPECT_EQ(decoded->attributes->statistics[36], 15);  // 255/255
    EXPECT_EQ(encodeSignature(*decoded)[4], 3) << "and written anew in version 3";
    EXPECT_FLOAT_EQ(decoded->points[0].volumeShare, 0.5208333f);
}

TEST(SignatureCodecAttributes, DecodeIsTheInverse) {
    Random random(1);
    for (std::size_t count = 1; count <= kMaxSignaturePoints; ++count) {
        const Signature signature = randomAttributed(random, count);
        const std::string bytes = encodeSignature(signature);
        EXPECT_EQ(bytes.size(), 56U + 44U * count + 224U);
        const auto decoded = decodeSignature(bytes);
        ASSERT_TRUE(decoded) << decoded.error().message;
        ASSERT_TRUE(decoded->attributes);
        EXPECT_TRUE(sameShape(*decoded, signature));
        EXPECT_EQ(decoded->attributes->quality, signature.attributes->quality);
        EXPECT_EQ(decoded->attributes->statistics, signature.attributes->statistics);
        expectSameBody(decoded->attributes->body, signature.attributes->body);
        EXPECT_EQ(encodeSignature(*decoded), bytes);

        // The same points without attributes are version 1 and stay without.
        Signature plain = signature;
        plain.attributes.reset();
        const std::string older = encodeSignature(plain);
        EXPECT_EQ(older.size(), 56U + 48U * count);
        EXPECT_EQ(older[4], 1);
        const auto read = decodeSignature(older);
        ASSERT_TRUE(read);
        EXPECT_FALSE(read->attributes);
        EXPECT_FALSE(sameShape(*read, signature));
    }
}

// A server decodes a million of them into the same object.
TEST(SignatureCodecAttributes, DecodingReplacesEarlierContents) {
    Random random(12);
    Signature used;
    for (int i = 0; i < 60; ++i) {
        Signature signature = randomAttributed(random, 1 + random.below(kMaxSignaturePoints));
        if (i % 3 == 1) signature.attributes.reset();
        const std::string bytes = encodeSignature(signature);
        if (i % 5 == 4) {
            EXPECT_FALSE(decodeSignature(withChecksum(bytes.substr(0, bytes.size() - 1)), used));
        }
        ASSERT_TRUE(decodeSignature(bytes, used));
        const Signature fresh = decodeSignature(bytes).value();
        EXPECT_EQ(encodeSignature(used), bytes);
        EXPECT_EQ(used.attributes.has_value(), fresh.attributes.has_value());
        if (!fresh.attributes) continue;
        const Body& body = used.attributes->body;
        EXPECT_EQ(body.segments, fresh.attributes->body.segments);
        EXPECT_EQ(body.centre, fresh.attributes->body.centre);
        EXPECT_EQ(body.axes, fresh.attributes->body.axes);
    }
}

TEST(SignatureCodecAttributes, DetectsDamage) {
    Random random(2);
    const std::string bytes = encodeSignature(randomAttributed(random, 3));
    for (std::size_t i = 0; i < bytes.size(); ++i) {
        for (int bit = 0; bit < 8; ++bit) {
            std::string damaged = bytes;
            damaged[i] = static_cast<char>(damaged[i] ^ (1 << bit));
            expectMalformed(damaged);
        }
        expectMalformed(bytes.substr(0, i));
    }
    expectMalformed(bytes + '\0');
    expectMalformed(bytes + bytes);
}

TEST(SignatureCodecAttributes, ChecksTheHeader) {
    const std::string bytes = encodeSignature(onePoint());  // version 4
    const auto changed = [&](std::size_t at, int value) {
        std::string other = bytes;
        other[at] = static_cast<char>(value);
        return withChecksum(other);
    };
    EXPECT_TRUE(decodeSignature(changed(8, 200))) << "the forged checksum is right";
    for (const int quality : {0, 255}) {
        const auto decoded = decodeSignature(changed(8, quality));
        ASSERT_TRUE(decoded) << quality;
        EXPECT_EQ(decoded->attributes->quality, quality);
    }
    for (const std::size_t at : {9U, 10U, 11U}) expectMalformed(changed(at, 1), "reserved");
    expectMalformed(changed(4, 1), "do not fit");
    expectMalformed(changed(4, 2), "do not fit");
    expectMalformed(changed(4, 3), "do not fit");
    expectMalformed(changed(4, 5), "version 5 is unknown");
    expectMalformed(changed(4, 0), "version 0 is unknown");
    expectMalformed(changed(5, 2), "unknown");
    expectMalformed(changed(6, 0), "0 points");
    expectMalformed(changed(6, 2), "do not fit");
    expectMalformed(changed(6, 17), "17 points");
    // 224 bytes of statistics are not points of version 1.
    for (int count = 2; count <= 16; ++count) expectMalformed(changed(6, count), "do not fit");
}

TEST(SignatureCodecAttributes, RefusesAPointHeavierThanTheWhole) {
    Signature signature = onePoint();
    signature.volume = 0.125 * 15.625;  // all of it in the one point
    const auto whole = decodeSignature(encodeSignature(signature));
    ASSERT_TRUE(whole);
    EXPECT_EQ(whole->points[0].volumeShare, 1.0f);
    signature.volume *= 0.999;
    expectMalformed(encodeSignature(signature), "point 0 outweighs the whole volume");
    signature.volume = 1e300;  // so light that nothing is left in single precision
    expectMalformed(encodeSignature(signature), "share");
}

TEST(SignatureCodecAttributes, RefusesRandomBytes) {
    Random random(3);
    for (int round = 0; round < 2000; ++round) {
        std::string bytes = encodeSignature(onePoint());
        const std::size_t from = random.below(bytes.size());
        for (std::size_t i = from; i < bytes.size() && i < from + 8; ++i) {
            bytes[i] = static_cast<char>(random.below(256));
        }
        const auto decoded = decodeSignature(withChecksum(bytes));  // anything but a crash
        if (decoded) {
            EXPECT_EQ(encodeSignature(*decoded), withChecksum(bytes));
        }
    }
}

TEST(SignatureCodecAttributes, DefaultProfileFitsAKilobyte) {
    const std::size_t most = parametersOf(Profile::kDefault).signature.maxPoints;
    Random random(4);
    EXPECT_LE(encodeSignature(randomAttributed(random, most)).size(), 1024U);
    ScanOptions options;
    options.count = 4000;
    const PointCloud points = scanOf(makeMember("octopus", 0, 1).value(), options).value();
    const Signature signature = describe(points, parametersOf(Profile::kDefault)).value().signature;
    ASSERT_TRUE(signature.attributes);
    const std::string bytes = encodeSignature(signature);
    EXPECT_LE(bytes.size(), 1024U);
    const auto decoded = decodeSignature(bytes);
    ASSERT_TRUE(decoded);
    EXPECT_TRUE(sameShape(*decoded, signature));
    expectSameBody(decoded->attributes->body, signature.attributes->body);
}

}  // namespace
}  // namespace shapedb
