// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/signature/segment_descriptor.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "core/base/random.h"
#include "core/signature/signature.h"
#include "tests/core/matching/attributed_signatures.h"

namespace shapedb {
namespace {

std::vector<WeightedPoint> randomPoints(Random& random, std::size_t count) {
    std::vector<WeightedPoint> points(count);
    for (std::size_t i = 0; i < count; ++i) {
        WeightedPoint& p = points[i];
        if (i > 0) {
            for (float& x : p.position) x = static_cast<float>(0.3 * random.normal());
        }
        p.weight = 0.1f / static_cast<float>(i + 1);
        p.volumeShare = 0.3f / static_cast<float>(i + 1);
        p.maximumRadius = static_cast<float>(random.uniform(0.01, 0.2));
        const Matrix3 r = randomRotation(random);
        const std::array<double, 3> s{random.uniform(0.01, 0.2), random.uniform(0.01, 0.2),
                                      random.uniform(0.01, 0.2)};
        const auto entry = [&](std::size_t row, std::size_t column) {
            double sum = 0.0;
            for (std::size_t k = 0; k < 3; ++k) sum += r[row][k] * r[column][k] * s[k] * s[k];
            return static_cast<float>(sum);
        };
        p.covariance = {entry(0, 0), entry(0, 1), entry(0, 2), entry(1, 1), entry(1, 2), entry(2, 2)};
    }
    return points;
}

// Positions are kept in steps of 1/16384, so they are off by up to half a step in each direction.
constexpr double kHalfStep = 0.9 / 16384.0;

Point3 at(const std::array<float, 3>& p) { return {p[0], p[1], p[2]}; }

TEST(Body, FrameIsRightHandedAndCentred) {
    Random random(1);
    for (int round = 0; round < 300; ++round) {
        const auto points = randomPoints(random, 1 + random.below(kMaxSignaturePoints));
        const Body body = bodyOf(points);
        ASSERT_EQ(body.segments.size(), points.size());
        EXPECT_NEAR(determinant(body.axes), 1.0, 1e-9);
        double total = 0.0;
        Point3 centre;
        for (std::size_t i = 0; i < points.size(); ++i) {
            total += points[i].weight;
            centre = centre + static_cast<double>(points[i].weight) * at(body.segments[i].position);
        }
        EXPECT_LT(length((1.0 / total) * centre), kHalfStep) << "the origin is the centroid of all matter";
        for (std::size_t i = 0; i < points.size(); ++i) {
            const SegmentDescriptor& part = body.segments[i];
            const Point3 expected = rotate(body.axes, at(points[i].position) - body.centre);
            EXPECT_LT(distance(at(part.position), expected), kHalfStep);
            EXPECT_NEAR(part.radius, length(expected), kHalfStep);
            EXPECT_LE(part.share, points[i].volumeShare + 1e-7);
            EXPECT_GT(part.share, points[i].volumeShare - 1.001 / 65535.0);
        }
    }
}

TEST(PackedSegmentDescriptor, LosesNothing) {
    Random random(9);
    for (int round = 0; round < 3000; ++round) {
        PackedSegmentDescriptor packedOnce;
        for (std::int16_t& x : packedOnce.position)
            x = static_cast<std::int16_t>(static_cast<int>(random.below(65535)) - 32767);
        packedOnce.share = static_cast<std::uint16_t>(1 + random.below(65535));
        for (std::uint8_t& size : packedOnce.size) size = static_cast<std::uint8_t>(random.below(256));
        ASSERT_TRUE(packed(unpacked(packedOnce)) == packedOnce);
    }
    for (int share = 1; share <= 65535; ++share) {
        PackedSegmentDescriptor part;
        part.share = static_cast<std::uint16_t>(share);
        ASSERT_EQ(packed(unpacked(part)).share, share);
    }
}

TEST(PackedSegmentDescriptor, RoundsHalvesAwayFromZero) {
    SegmentDescriptor part;
    part.share = 0.5f;
    const auto step = [&](float position) {
        part.position = {position, -position, 0.0f};
        const PackedSegmentDescriptor result = packed(part);
        EXPECT_EQ(result.position[1], -result.position[0]) << position;
        return static_cast<long>(result.position[0]);
    };
    for (long i = 0; i < 32767; ++i) {
        // Half a step, and the numbers next to it.
        const float half = static_cast<float>((static_cast<double>(i) + 0.5) / kPositionSteps);
        for (const float p : {half, std::nextafter(half, 0.0f), std::nextafter(half, 9.0f)}) {
            ASSERT_EQ(step(p), std::lround(static_cast<double>(p) * kPositionSteps)) << p;
        }
    }
    EXPECT_EQ(step(100.0f), 32767);
}

// In the frame, the moments of all matter are diagonal and falling.
TEST(Body, FrameLiesAlongThePrincipalAxes) {
    Random random(2);
    for (int round = 0; round < 200; ++round) {
        const auto points = randomPoints(random, 2 + random.below(10));
        const Body body = bodyOf(points);
        Matrix3 moments{};
        double total = 0.0;
        for (std::size_t n = 0; n < points.size(); ++n) {
            const auto& c = points[n].covariance;
            const Matrix3 own = {{{c[0], c[1], c[2]}, {c[1], c[3], c[4]}, {c[2], c[4], c[5]}}};
            const std::array<double, 3> p{body.segments[n].position[0], body.segments[n].position[1],
                                          body.segments[n].position[2]};
            total += points[n].weight;
            for (std::size_t i = 0; i < 3; ++i) {
                for (std::size_t j = 0; j < 3; ++j) {
                    double turned = p[i] * p[j];
                    for (std::size_t k = 0; k < 3; ++k) {
                        for (std::size_t l = 0; l < 3; ++l) {
                            turned += body.axes[i][k] * own[k][l] * body.axes[j][l];
                        }
                    }
                    moments[i][j] += points[n].weight * turned;
                }
            }
        }
        EXPECT_GE(moments[0][0], moments[1][1] - 1e-4 * total);
        EXPECT_GE(moments[1][1], moments[2][2] - 1e-4 * total);
        for (std::size_t i = 0; i < 3; ++i) {
            for (std::size_t j = 0; j < i; ++j) EXPECT_LT(std::abs(moments[i][j]), 1e-4 * total);
        }
    }
}

TEST(SegmentDescriptor, SizesAreLogarithmsOfExtentsAndMaximumRadius) {
    WeightedPoint point;
    point.weight = 0.1f;
    point.volumeShare = 1.0f;
    point.maximumRadius = 0.125f;
    point.covariance = {0.0625f * 0.0625f, 0, 0, 0.25f * 0.25f, 0, 0.5f * 0.5f};
    const SegmentDescriptor part = bodyOf({point}).segments.front();
    EXPECT_NEAR(part.size[0], -1.0f, 1e-6f);
    EXPECT_NEAR(part.size[1], -2.0f, 1e-6f);
    EXPECT_NEAR(part.size[2], -4.0f, 1e-6f);
    EXPECT_NEAR(part.size[3], -3.0f, 1e-6f);
    EXPECT_EQ(part.position, (std::array<float, 3>{}));
    EXPECT_EQ(part.radius, 0.0f);

    // Flat matter, rounded below zero, and a maximum in a flat tetrahedron: both ends are bounded.
    point.covariance = {1e-20f, 0, 0, -1e-9f, 0, 0};
    point.maximumRadius = 1e30f;
    const SegmentDescriptor flat = bodyOf({point}).segments.front();
    for (std::size_t i = 0; i < 3; ++i)
        EXPECT_EQ(flat.size[i], std::log2(static_cast<float>(kSmallestLength)));
    EXPECT_EQ(flat.size[3], 0.0f);
    point.maximumRadius = 1e-30f;
    EXPECT_EQ(bodyOf({point}).segments.front().size[3], std::log2(static_cast<float>(kSmallestLength)));
}

TEST(SegmentDescriptor, SizesAndRadiiDoNotChangeUnderRotation) {
    Random random(3);
    for (int round = 0; round < 100; ++round) {
        const auto points = randomPoints(random, 1 + random.below(8));
        const Matrix3 r = randomRotation(random);
        auto turned = points;
        for (WeightedPoint& p : turned) {
            const Point3 q = rotate(r, at(p.position));
            p.position = {static_cast<float>(q.x), static_cast<float>(q.y), static_cast<float>(q.z)};
            p.covariance = testing_support::turnedCovariance(p.covariance, r);
        }
        const Body a = bodyOf(points);
        const Body b = bodyOf(turned);
        for (std::size_t i = 0; i < points.size(); ++i) {
            EXPECT_NEAR(a.segments[i].radius, b.segments[i].radius, 1e-6f);
            for (std::size_t k = 0; k < 4; ++k)
                EXPECT_NEAR(a.segments[i].size[k], b.segments[i].size[k], 1e-3f);
        }
    }
}

}  // namespace
}  // namespace shapedb
