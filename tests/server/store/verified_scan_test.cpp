// SPDX-License-Identifier: GPL-3.0-or-later
#include "server/store/verified_scan.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "core/base/random.h"
#include "core/preparation/sanitise.h"

namespace shapedb::store {
namespace {

std::vector<float> cube(std::size_t points, std::uint64_t seed = 1) {
    Random random(seed);
    std::vector<float> xyz(3 * points);
    for (float& value : xyz) value = static_cast<float>(random.uniform(-1.0, 1.0));
    return xyz;
}

std::vector<float> flat(std::size_t points) {
    auto xyz = cube(points);
    for (std::size_t i = 2; i < xyz.size(); i += 3) xyz[i] = 0.5f;
    return xyz;
}

/// What a check of all points says.
Result<void> sanitiseAll(const std::vector<float>& xyz) {
    PointCloud points;
    for (std::size_t i = 0; i < xyz.size(); i += 3) points.push_back({xyz[i], xyz[i + 1], xyz[i + 2]});
    const auto sanitised = sanitise(points);
    if (!sanitised) return fail(sanitised.error());
    return {};
}

void expectRefusedAsBySanitise(const std::vector<float>& xyz) {
    const auto verified = VerifiedScan::verify(xyz);
    const auto all = sanitiseAll(xyz);
    ASSERT_FALSE(verified);
    ASSERT_FALSE(all);
    EXPECT_EQ(verified.error().code, all.error().code);
    // A remedy may follow.
    EXPECT_EQ(verified.error().message.rfind(all.error().message, 0), 0u) << verified.error().message;
}

TEST(VerifiedScan, KeepsPointsAndTheirChecksum) {
    for (const std::size_t count : {std::size_t{4}, std::size_t{100'000}}) {
        const auto xyz = cube(count);
        const auto scan = VerifiedScan::verify(xyz);
        ASSERT_TRUE(scan) << scan.error().message;
        EXPECT_EQ(scan->points(), xyz);
        EXPECT_EQ(scan->pointCount(), count);
        EXPECT_EQ(scan->bytes(), 12 * count);
        EXPECT_EQ(scan->checksum(), sha256(xyz.data(), 4 * xyz.size()));
    }
}

TEST(VerifiedScan, RefusesNumbersThatAreNotTriples) {
    EXPECT_EQ(VerifiedScan::verify(std::vector<float>(13, 1.0f)).error().code, ErrorCode::kInvalidArgument);
}

TEST(VerifiedScan, RefusesNonFiniteCoordinates) {
    auto xyz = cube(10);
    xyz[7] = std::numeric_limits<float>::quiet_NaN();
    const auto refused = VerifiedScan::verify(xyz);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::kNonFiniteCoordinate);
    EXPECT_NE(refused.error().message.find("point 2: y is NaN"), std::string::npos);
}

TEST(VerifiedScan, RefusesWhatSanitiseRefuses) {
    expectRefusedAsBySanitise({});
    expectRefusedAsBySanitise({1, 2, 3});
    expectRefusedAsBySanitise(flat(5'000));
    expectRefusedAsBySanitise(std::vector<float>(300, 7.0f));
    std::vector<float> line;
    for (int i = 0; i < 1'000; ++i) {
        for (const int factor : {1, 2, 3}) line.push_back(static_cast<float>(factor * i));
    }
    expectRefusedAsBySanitise(line);
    // Three distinct points, repeated: the message counts all of them.
    std::vector<float> three;
    for (int i = 0; i < 1'000; ++i) {
        for (int axis = 0; axis < 3; ++axis) three.push_back(i % 3 == axis ? 1.0f : 0.0f);
    }
    expectRefusedAsBySanitise(three);
}

TEST(VerifiedScan, FindsOnePointOffThePlaneAnywhere) {
    for (const std::size_t at : {std::size_t{0}, std::size_t{1}, std::size_t{4'321}, std::size_t{9'999}}) {
        auto xyz = flat(10'000);
        xyz[3 * at + 2] = 0.6f;
        EXPECT_TRUE(VerifiedScan::verify(xyz)) << at;
    }
}

TEST(VerifiedScan, FindsOnePointTooFarAwayAnywhere) {
    for (const std::size_t at : {std::size_t{0}, std::size_t{1}, std::size_t{4'321}, std::size_t{9'999}}) {
        auto xyz = cube(10'000);
        xyz[3 * at + 1] = 3.402e38f;
        expectRefusedAsBySanitise(xyz);
    }
}

/// A cube of `size` about (4.4e6, -5.2e6, 120), rounded to single precision, after some points of another
/// place.
std::vector<float> farCube(float size, std::vector<float> first, std::size_t points = 2'000) {
    for (const float value : cube(points)) {
        const std::size_t axis = first.size() % 3;
        first.push_back((axis == 0 ? 4.4e6f : axis == 1 ? -5.2e6f : 120.0f) + 0.5f * size * value);
    }
    return first;
}

TEST(VerifiedScan, OutliersDoNotHideThatAScanIsLost) {
    const std::vector<std::vector<float>> ofOutliers = {
        {0, 0, 0}, {0, 0, 0, 0, 0, 0, 0, 0, 0}, {1e9f, 0, 0}, {0, 0, 0, 1e6f, 0, 0, 0, 1e6f, 0, 0, 0, 1e6f}};
    for (const auto& outliers : ofOutliers) {
        for (const float size : {1e-3f, 0.1f, 0.7f, 2.0f, 50.0f, 200.0f}) {
            for (const std::size_t points : {100u, 2'000u}) {
                const auto refused = VerifiedScan::verify(farCube(size, outliers, points));
                ASSERT_FALSE(refused) << size << ", " << outliers.size() / 3 << " outliers";
                EXPECT_NE(refused.error().message.find("field origin of the header"), std::string::npos)
                    << size << ": " << refused.error().message;
            }
        }
        EXPECT_TRUE(VerifiedScan::verify(farCube(5'000.0f, outliers))) << "large enough to keep its shape";
    }
}

TEST(VerifiedScan, WhatRoundingFlattenedIsToldTheRemedy) {
    for (const float size : {1e-3f, 0.1f, 0.3f, 0.6f, 2.0f}) {
        for (const std::size_t points : {4u, 5u, 10u, 50u}) {
            const auto refused = VerifiedScan::verify(farCube(size, {}, points));
            ASSERT_FALSE(refused);
            EXPECT_NE(refused.error().message.find("field origin of the header"), std::string::npos)
                << size << ", " << points << " points: " << refused.error().message;
        }
    }
    // A wall in single precision: it was not one before.
    std::vector<float> wall = flat(1'000);
    for (std::size_t i = 0; i < wall.size(); ++i) wall[i] = i % 3 == 2 ? 4.4e6f : 900.0f * wall[i];
    const auto refused = VerifiedScan::verify(wall);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::kCoplanar);
    EXPECT_NE(refused.error().message.find("field origin"), std::string::npos) << refused.error().message;
}

TEST(VerifiedScan, AFarOutlierIsToldToBeDropped) {
    auto xyz = cube(1'000);
    for (int axis = 0; axis < 3; ++axis) xyz.push_back(-4.4e6f);
    const auto refused = VerifiedScan::verify(xyz);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::kCollinear);
    EXPECT_NE(refused.error().message.find("All but 1 point"), std::string::npos) << refused.error().message;
    EXPECT_NE(refused.error().message.find("drop those"), std::string::npos);
}

TEST(ScanVerifier, ComparesTheAnnouncedChecksum) {
    const auto xyz = cube(100);
    Checksum expected = sha256(xyz.data(), 4 * xyz.size());
    for (const bool right : {true, false}) {
        if (!right) expected[0] ^= 1;
        ScanVerifier verifier;
        ASSERT_TRUE(verifier.append(xyz.data(), 4 * xyz.size()));
        const auto scan = verifier.finish(&expected);
        ASSERT_EQ(scan.has_value(), right);
        if (!right) {
            EXPECT_EQ(scan.error().code, ErrorCode::kChecksumMismatch);
        }
    }
}

TEST(ScanVerifier, PiecesGiveTheSameScan) {
    const auto xyz = cube(1'000);
    const auto whole = VerifiedScan::verify(xyz);
    ASSERT_TRUE(whole);
    for (const std::size_t points : {std::size_t{1}, std::size_t{7}, std::size_t{1'000}}) {
        ScanVerifier verifier;
        for (std::size_t at = 0; at < 1'000; at += points) {
            const std::size_t count = std::min(points, 1'000 - at);
            ASSERT_TRUE(verifier.append(xyz.data() + 3 * at, 12 * count));
        }
        const auto scan = verifier.finish();
        ASSERT_TRUE(scan);
        EXPECT_EQ(scan->points(), whole->points());
        EXPECT_EQ(scan->checksum(), whole->checksum());
    }
}

TEST(VerifiedScan, TooFarFromTheOriginForSinglePrecisionIsRefused) {
    const auto at = [](float x) {
        std::vector<float> xyz;
        for (int i = 0; i < 1'000; ++i) {
            const float t = static_cast<float>(i);
            for (const float c : {x + std::sin(t), std::cos(3.0f * t), std::sin(7.0f * t)}) xyz.push_back(c);
        }
        return VerifiedScan::verify(std::move(xyz));
    };
    EXPECT_TRUE(at(0.0f));
    EXPECT_TRUE(at(1e4f));
    for (const float far : {4.4e6f, -4.4e6f, 1e5f, 3e38f}) {
        const auto refused = at(far);
        ASSERT_FALSE(refused) << far;
        EXPECT_EQ(refused.error().code, ErrorCode::kCoordinateOutOfRange);
        EXPECT_NE(refused.error().message.find("relative to an origin near them"), std::string::npos)
            << refused.error().message;
    }
}

TEST(VerifiedScan, KeepsItsOriginBesideTheChecksumOfThePoints) {
    const auto xyz = cube(1'000);
    const Point3 origin{4.4e6, -5.2e6, 120.5};
    const auto placed = VerifiedScan::verify(xyz, origin);
    ASSERT_TRUE(placed) << placed.error().message;
    EXPECT_EQ(placed->origin(), origin);
    EXPECT_EQ(placed->points(), xyz);
    const auto plain = VerifiedScan::verify(xyz);
    EXPECT_EQ(plain->origin(), Point3{});
    EXPECT_EQ(placed->checksum(), plain->checksum());
}

TEST(VerifiedScan, TheOriginIsNearEnoughForDoublePrecision) {
    const auto xyz = cube(1'000);  // 3.5 across
    EXPECT_TRUE(VerifiedScan::verify(xyz, {0.0, 1.7e10, 0.0}));
    const auto beyond = VerifiedScan::verify(xyz, {0.0, 3.5e10, 0.0});
    ASSERT_FALSE(beyond);
    EXPECT_EQ(beyond.error().code, ErrorCode::kCoordinateOutOfRange);
    EXPECT_EQ(beyond.error().message.rfind("origin: ", 0), 0u) << beyond.error().message;
    auto huge = xyz;
    for (float& value : huge) value *= 1e38f;
    EXPECT_TRUE(VerifiedScan::verify(huge));
    EXPECT_TRUE(VerifiedScan::verify(huge, {-2.3e38, 0.0, 0.0}));
    const auto sum = VerifiedScan::verify(huge, {0.0, 0.0, 3e38});
    ASSERT_FALSE(sum);
    EXPECT_NE(sum.error().message.find("beyond 3.4e38"), std::string::npos) << sum.error().message;
}

}  // namespace
}  // namespace shapedb::store
