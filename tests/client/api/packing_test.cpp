// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/api/packing.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "common/sha256.h"
#include "core/base/random.h"
#include "core/geometry/resolution.h"

namespace shapedb::client {
namespace {

PointCloud cloud(double size, const Point3& at, std::size_t count = 200) {
    Random random(11);
    PointCloud points;
    for (std::size_t i = 0; i < count; ++i) {
        points.push_back(
            at + size * Point3{random.uniform() - 0.5, random.uniform() - 0.5, random.uniform() - 0.5});
    }
    return points;
}

PointCloud unpacked(const PackedPoints& packed) {
    PointCloud points;
    EXPECT_TRUE(unpackPoints(packed.bytes, packed.origin, points));
    return points;
}

TEST(Packing, BytesAreLittleEndianFloats) {
    const auto packed = packPoints({{1.0, -2.0, 0.5}});
    ASSERT_TRUE(packed);
    EXPECT_EQ(packed->bytes, std::string("\x00\x00\x80\x3f\x00\x00\x00\xc0\x00\x00\x00\x3f", 12));
    EXPECT_EQ(packed->count, 1u);
    const Sha256Digest digest = sha256(packed->bytes.data(), packed->bytes.size());
    EXPECT_EQ(packed->sha256, std::string(digest.begin(), digest.end()));
    EXPECT_EQ(packed->origin, Point3{});
}

TEST(Packing, RoundTripsAtEverySize) {
    for (const double size : {1e-30, 1e-6, 1.0, 1e6, 1e30}) {
        const PointCloud points = cloud(size, {});
        const auto packed = packPoints(points);
        ASSERT_TRUE(packed) << size << packed.error().message;
        EXPECT_EQ(packed->origin, Point3{});
        const PointCloud back = unpacked(*packed);
        for (std::size_t i = 0; i < points.size(); ++i) {
            EXPECT_LT(std::sqrt(3.0) * std::abs(back[i].x - points[i].x), 1e-6 * size);
        }
    }
}

TEST(Packing, KeepsTheShapeFarFromTheOrigin) {
    const Point3 far{4.5e6, -5.4e6, 300.0};
    const PointCloud points = cloud(2.0, far);
    const auto packed = packPoints(points);
    ASSERT_TRUE(packed);
    EXPECT_LT(distance(packed->origin, far), 2.0);
    const PointCloud back = unpacked(*packed);
    for (std::size_t i = 0; i < points.size(); ++i) {
        EXPECT_LT(distance(back[i], points[i]), 2e-6) << "a millionth of the size";
    }
}

TEST(Packing, TheOriginMovesWhereRoundingWouldHurt) {
    const double size = 1.0;
    const auto originAt = [&](double distanceFromOrigin) {
        PointCloud corners = {{0, 0, 0}, {size, 0, 0}, {0, size, 0}, {0, 0, size}};
        for (Point3& p : corners) p.x += distanceFromOrigin;
        return packPoints(corners)->origin;
    };
    const double diagonal = std::sqrt(3.0);
    EXPECT_EQ(originAt(kFarFromOrigin * diagonal - 1.1), Point3{});
    EXPECT_NE(originAt(kFarFromOrigin * diagonal), Point3{});
    // Without an origin no coordinate moves by more than a millionth of the diagonal.
    const double x = kFarFromOrigin * diagonal - 1.1 + 0.123456789;
    EXPECT_LE(std::abs(static_cast<double>(static_cast<float>(x)) - x), diagonal * 0x1p-20);
}

TEST(Packing, SameScanGivesTheSameBytes) {
    const PointCloud points = cloud(1.0, {1e7, 1e7, 0.0});
    EXPECT_EQ(packPoints(points)->sha256, packPoints(points)->sha256);
}

TEST(Packing, RefusesCoordinatesBeyondSinglePrecision) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const double infinity = std::numeric_limits<double>::infinity();
    const auto codeOf = [](const PointCloud& points) { return packPoints(points).error().code; };
    PointCloud points = cloud(1.0, {});
    EXPECT_EQ(codeOf({}), ErrorCode::kTooFewPoints);
    points[7].y = nan;
    EXPECT_EQ(codeOf(points), ErrorCode::kNonFiniteCoordinate);
    EXPECT_NE(packPoints(points).error().message.find("point 7"), std::string::npos);
    points[7].y = -infinity;
    EXPECT_EQ(codeOf(points), ErrorCode::kNonFiniteCoordinate);
    points[7].y = 1e300;
    EXPECT_EQ(codeOf(points), ErrorCode::kCoordinateOutOfRange);
    EXPECT_NE(packPoints(points).error().message.find("point 7"), std::string::npos);
    EXPECT_EQ(codeOf(cloud(1e-300, {})), ErrorCode::kCoordinateOutOfRange);
    EXPECT_EQ(codeOf(cloud(1e-35, {})), ErrorCode::kCoordinateOutOfRange);
}

TEST(Packing, AcceptsEqualPoints) { EXPECT_TRUE(packPoints(PointCloud(10, Point3{1e9, 0.0, 0.0}))); }

TEST(Packing, ChunksHoldWholePointsAndAtMostOneMebibyte) {
    EXPECT_EQ(kChunkBytes % kPointBytes, 0u);
    EXPECT_LE(kChunkBytes, std::size_t{1} << 20);
    EXPECT_GT(kChunkBytes, (std::size_t{1} << 20) - kPointBytes);
}

TEST(Packing, UnpackRefusesAPartialPoint) {
    PointCloud points;
    const auto result = unpackPoints(std::string(13, '\0'), {}, points);
    ASSERT_FALSE(result);
    EXPECT_EQ(result.error().code, ErrorCode::kMalformedStream);
}

TEST(Packing, UnpackingKeepsEveryBitWithoutAnOrigin) {
    PointCloud points;
    ASSERT_TRUE(
        unpackPoints(std::string("\x00\x00\x00\x80\x00\x00\x80\x3f\x01\x00\x00\x00", 12), {}, points));
    EXPECT_TRUE(std::signbit(points[0].x));
    EXPECT_EQ(points[0].z, 0x1p-149);
}

TEST(Packing, PointsThatWereRoundedBeforeAreRefused) {
    PointCloud points = cloud(2.0, {4.5e6, -5.4e6, 300.0});
    EXPECT_TRUE(packPoints(points));
    for (Point3& p : points) {
        for (double* c : {&p.x, &p.y, &p.z}) *c = static_cast<double>(static_cast<float>(*c));
    }
    const auto refused = packPoints(points);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.error().code, ErrorCode::kCoordinateOutOfRange);
}

TEST(Packing, OutliersDoNotChooseTheOrigin) {
    const Point3 far{4.5e6, -5.4e6, 300.0};
    for (const double size : {0.1, 2.0, 100.0, 5'000.0}) {
        for (const PointCloud& outliers :
             std::vector<PointCloud>{{{}}, {{}, {}, {1e7, 1e7, 1e7}}, {{-1e30, 0.0, 0.0}}}) {
            PointCloud points = cloud(size, far);
            const PointCloud scan = points;
            points.insert(points.begin(), outliers.begin(), outliers.end());
            const auto packed = packPoints(points);
            ASSERT_TRUE(packed) << packed.error().message;
            EXPECT_LT(distance(packed->origin, far), size);
            const PointCloud back = unpacked(*packed);
            for (std::size_t i = 0; i < scan.size(); ++i) {
                EXPECT_LT(distance(back[i + outliers.size()], scan[i]), 1e-6 * size);
            }
        }
    }
    PointCloud near = cloud(2.0, {});
    near.push_back({1e9, 0.0, 0.0});
    EXPECT_EQ(packPoints(near)->origin, Point3{});
    // What would be infinite once the origin is subtracted.
    PointCloud apart = cloud(1e30, {3e38, 0.0, 0.0});
    apart.push_back({-3e38, 0.0, 0.0});
    EXPECT_EQ(packPoints(apart).error().code, ErrorCode::kCoordinateOutOfRange);
}

TEST(Packing, AThinStripIsSentRelativeToItself) {
    // 5 diagonals away, so not far, but its width has few steps there.
    PointCloud strip = cloud(1.0, {});
    for (Point3& p : strip) p = {p.x, 5.0 + 1e-5 * p.y, p.z};
    const auto packed = packPoints(strip);
    ASSERT_TRUE(packed);
    EXPECT_NEAR(packed->origin.y, 5.0, 1e-5);
    const PointCloud back = unpacked(*packed);
    for (std::size_t i = 0; i < strip.size(); ++i) EXPECT_LT(std::abs(back[i].y - strip[i].y), 1e-11);
}

}  // namespace
}  // namespace shapedb::client
