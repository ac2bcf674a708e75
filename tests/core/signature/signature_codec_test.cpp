// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/signature/signature_codec.h"

#include <cmath>
#include <functional>
#include <limits>
#include <string>

#include <gtest/gtest.h>

#include "core/base/random.h"
#include "tests/core/signature/forged_bytes.h"

namespace shapedb {
namespace {

using testing_support::expectMalformed;
using testing_support::withChecksum;

Signature twoPoints() {
    Signature signature;
    signature.scale = 2.5;
    signature.origin = {1.0, -2.0, 0.125};
    signature.volume = 3.75;
    signature.points.resize(2);
    signature.points[0] = {{0.0f, 0.0f, 0.0f}, 0.125f, 0.75f, 0.25f, {0.01f, 0.0f, 0.0f, 0.02f, 0.0f, 0.03f}};
    signature.points[1] = {
        {0.5f, -0.25f, 0.0625f}, 0.03125f, 0.25f, 0.125f, {1.0f, 2.0f, 3.0f, 4.0f, 5.0f, 6.0f}};
    return signature;
}

std::string hex(const std::string& bytes) {
    std::string text;
    for (const char c : bytes) {
        const auto byte = static_cast<unsigned char>(c);
        text += "0123456789abcdef"[byte >> 4];
        text += "0123456789abcdef"[byte & 15];
    }
    return text;
}

// Stored signatures must stay readable: these bytes never change.
TEST(SignatureCodec, ReadsAndWritesTheGoldenBytes) {
    const std::string golden =
        "53444247"          // SDBG
        "0100"              // version 1
        "0200"              // two points
        "00000000"          // reserved
        "0000000000000440"  // scale 2.5
        "000000000000f03f"
        "00000000000000c0"
        "000000000000c03f"  // origin 1, -2, 0.125
        "0000000000000e40"  // volume 3.75
        "00000000"
        "00000000"
        "00000000"  // position
        "0000003e"
        "0000403f"
        "0000803e"  // weight, share, radius of its largest ball
        "0ad7233c"
        "00000000"
        "00000000"
        "0ad7a33c"
        "00000000"
        "8fc2f53c"
        "0000003f"
        "000080be"
        "0000803d"
        "0000003d"
        "0000803e"
        "0000003e"
        "0000803f"
        "00000040"
        "00004040"
        "00008040"
        "0000a040"
        "0000c040"
        "da4e7b1f";
    const std::string bytes = encodeSignature(twoPoints());
    EXPECT_EQ(hex(bytes), golden);
    EXPECT_EQ(bytes.size(), 152U);
}

void expectSame(const Signature& a, const Signature& b) {
    EXPECT_TRUE(sameShape(a, b));
    EXPECT_EQ(a.scale, b.scale);
    EXPECT_EQ(a.origin, b.origin);
    EXPECT_EQ(a.volume, b.volume);
    for (std::size_t i = 0; i < a.points.size(); ++i) {
        EXPECT_EQ(a.points[i].volumeShare, b.points[i].volumeShare);
        EXPECT_EQ(a.points[i].maximumRadius, b.points[i].maximumRadius);
        EXPECT_EQ(a.points[i].covariance, b.points[i].covariance);
    }
}

TEST(SignatureCodec, DecodeIsTheInverse) {
    Random random(1);
    for (std::uint32_t count = 1; count <= kMaxSignaturePoints; ++count) {
        Signature signature;
        signature.scale = std::exp(random.uniform(-80, 80));
        signature.volume = std::exp(random.uniform(-80, 80));
        signature.origin = {random.normal() * 1e30, random.normal(), random.normal() * 1e-30};
        for (std::uint32_t i = 0; i < count; ++i) {
            WeightedPoint point;
            if (i > 0) {
                for (float& v : point.position) v = static_cast<float>(random.normal());
            }
            point.weight = 1.0f / static_cast<float>(i + 1);
            point.volumeShare = static_cast<float>(1.0 - random.uniform());
            point.maximumRadius = static_cast<float>(random.uniform(0.1, 1));
            for (float& v : point.covariance) v = static_cast<float>(random.normal());
            signature.points.push_back(point);
        }
        const std::string bytes = encodeSignature(signature);
        EXPECT_EQ(bytes.size(), 56U + 48U * count);
        const auto decoded = decodeSignature(bytes);
        ASSERT_TRUE(decoded) << decoded.error().message;
        expectSame(signature, *decoded);
        EXPECT_EQ(encodeSignature(*decoded), bytes);
    }
}

TEST(SignatureCodec, DetectsEveryDamagedByte) {
    const std::string bytes = encodeSignature(twoPoints());
    for (std::size_t i = 0; i < bytes.size(); ++i) {
        for (int bit = 0; bit < 8; ++bit) {
            std::string damaged = bytes;
            damaged[i] = static_cast<char>(damaged[i] ^ (1 << bit));
            expectMalformed(damaged);
        }
        std::string damaged = bytes;
        damaged[i] = static_cast<char>(~damaged[i]);
        expectMalformed(damaged);
    }
}

TEST(SignatureCodec, RefusesEveryTruncationAndExtension) {
    const std::string bytes = encodeSignature(twoPoints());
    for (std::size_t size = 0; size < bytes.size(); ++size) expectMalformed(bytes.substr(0, size));
    expectMalformed(bytes + '\0');
    expectMalformed(bytes + bytes);
}

TEST(SignatureCodec, ChecksTheHeader) {
    const std::string bytes = encodeSignature(twoPoints());
    const auto changed = [&](std::size_t at, char value) {
        std::string other = bytes;
        other[at] = value;
        return withChecksum(other);
    };
    EXPECT_TRUE(decodeSignature(withChecksum(bytes))) << "the forged checksum is right";
    expectMalformed(changed(0, 'X'), "SDBG");
    expectMalformed(changed(4, 2), "do not fit");  // version 2 without its statistics
    expectMalformed(changed(4, 3), "do not fit");
    expectMalformed(changed(4, 5), "version 5 is unknown");
    expectMalformed(changed(4, 0), "version 0 is unknown");
    expectMalformed(changed(6, 0), "0 points");
    expectMalformed(changed(6, 17), "17 points");
    expectMalformed(changed(6, 1), "do not fit");
    expectMalformed(changed(6, 3), "do not fit");
    expectMalformed(changed(8, 1), "reserved");
}

TEST(SignatureCodec, RefusesBadNumbers) {
    const auto refused = [](const std::string& word, const std::function<void(Signature&)>& spoil) {
        Signature signature = twoPoints();
        spoil(signature);
        expectMalformed(encodeSignature(signature), word);
    };
    const double nan = std::nan("");
    const float inf = std::numeric_limits<float>::infinity();
    for (const double bad : {0.0, -1.0, nan, std::numeric_limits<double>::infinity()}) {
        refused("scale", [&](Signature& s) { s.scale = bad; });
        refused("volume", [&](Signature& s) { s.volume = bad; });
    }
    for (const double absurd : {1e-60, 1e60}) refused("scale", [&](Signature& s) { s.scale = absurd; });
    refused("origin", [&](Signature& s) { s.origin.y = nan; });
    refused("point 1", [&](Signature& s) { s.points[1].position[2] = inf; });
    refused("point 1", [&](Signature& s) { s.points[1].covariance[5] = std::nanf(""); });
    refused("point 0", [&](Signature& s) { s.points[0].weight = -inf; });
    refused("weight", [&](Signature& s) { s.points[1].weight = 0.0f; });
    refused("weight", [&](Signature& s) { s.points[1].weight = -0.01f; });
    refused("heavier", [&](Signature& s) { s.points[1].weight = 0.126f; });
    refused("share", [&](Signature& s) { s.points[0].volumeShare = 1.5f; });
    refused("share", [&](Signature& s) { s.points[1].volumeShare = 0.0f; });
    refused("largest ball without a positive radius",
            [&](Signature& s) { s.points[1].maximumRadius = 0.0f; });
    refused("origin", [&](Signature& s) { s.points[0].position[0] = 0.001f; });
    refused("too few", [&](Signature& s) { s.points.clear(); });
    refused("17 points", [&](Signature& s) { s.points.resize(17, s.points[1]); });
}

}  // namespace
}  // namespace shapedb
