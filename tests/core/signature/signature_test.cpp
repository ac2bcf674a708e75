// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/signature/signature.h"

#include <cmath>

#include <gtest/gtest.h>

#include "core/synthetic/named_shapes.h"

namespace shapedb {
namespace {

// Ten segments of falling volume along x, in a shape of size 4.
Segmentation tenSegments() {
    Segmentation s;
    s.size = 4.0;
    for (int i = 0; i < 10; ++i) {
        Segment segment;
        segment.volume = 10.0 - i;
        segment.centroid = {5.0 + i, -1.0, 0.5 * i};
        segment.maximumRadius = 1.0 + i;
        segment.covariance = {4.0, 0.0, 0.0, 9.0, 0.0, 1.0};
        s.segments.push_back(segment);
        s.volume += segment.volume;
    }
    return s;
}

TEST(Signature, FieldsAreRelativeToScaleAndHeaviestPoint) {
    const auto signature = makeSignature(tenSegments(), {});
    ASSERT_TRUE(signature);
    EXPECT_EQ(signature->scale, 4.0);
    EXPECT_EQ(signature->volume, 55.0);
    EXPECT_EQ(signature->origin, (Point3{5.0, -1.0, 0.0}));
    ASSERT_EQ(signature->points.size(), 7U) << "the paper: less than ten";
    for (std::size_t i = 0; i < 7; ++i) {
        const WeightedPoint& p = signature->points[i];
        const float at = static_cast<float>(i);
        EXPECT_EQ(p.position, (std::array<float, 3>{at / 4.0f, 0.0f, at / 8.0f}));
        EXPECT_EQ(p.weight, (10.0f - at) / 64.0f);
        EXPECT_FLOAT_EQ(p.volumeShare, (10.0f - at) / 55.0f);
        EXPECT_EQ(p.maximumRadius, (1.0f + at) / 4.0f);
        EXPECT_EQ(p.covariance, (std::array<float, 6>{0.25f, 0.0f, 0.0f, 0.5625f, 0.0f, 0.0625f}));
        EXPECT_LT(distance(pointPosition(*signature, i), tenSegments().segments[i].centroid), 1e-6);
        EXPECT_NEAR(pointVolume(*signature, i), 10.0 - static_cast<double>(i), 1e-6);
        const auto extents = pointExtents(*signature, i);
        EXPECT_NEAR(extents[0], 3.0, 1e-6);
        EXPECT_NEAR(extents[1], 2.0, 1e-6);
        EXPECT_NEAR(extents[2], 1.0, 1e-6);
    }
}

TEST(Signature, KeepsAsManyPointsAsConfigured) {
    for (const std::uint32_t count : {1U, 2U, 9U, 10U, kMaxSignaturePoints}) {
        const auto signature = makeSignature(tenSegments(), {count});
        ASSERT_TRUE(signature);
        EXPECT_EQ(signature->points.size(), std::min(count, 10U));
    }
    for (const std::uint32_t count : {0U, kMaxSignaturePoints + 1, 4000000000U}) {
        const auto refused = makeSignature(tenSegments(), {count});
        ASSERT_FALSE(refused);
        EXPECT_EQ(refused.error().code, ErrorCode::kInvalidArgument);
        EXPECT_NE(refused.error().message.find("max_points"), std::string::npos);
        EXPECT_NE(refused.error().message.find(std::to_string(count)), std::string::npos);
    }
}

TEST(Signature, WorksForOneSegment) {
    Segmentation s = tenSegments();
    s.segments.resize(1);
    s.volume = 10.0;
    const auto signature = makeSignature(s, {});
    ASSERT_TRUE(signature);
    ASSERT_EQ(signature->points.size(), 1U);
    EXPECT_EQ(signature->points[0].volumeShare, 1.0f);
    EXPECT_EQ(signature->points[0].position, (std::array<float, 3>{}));
}

TEST(Signature, OmitsSegmentsTooLightForSinglePrecision) {
    Segmentation s = tenSegments();
    s.segments[3].volume = 1e-60;
    s.segments.resize(4);
    EXPECT_EQ(makeSignature(s, {})->points.size(), 3U);
    s.segments[0].maximumRadius = 1e300;
    EXPECT_TRUE(std::isfinite(makeSignature(s, {})->points[0].maximumRadius));
    s.segments = {s.segments[3]};
    EXPECT_EQ(makeSignature(s, {}).error().code, ErrorCode::kNoInterior);
    EXPECT_EQ(makeSignature(Segmentation{}, {}).error().code, ErrorCode::kNoInterior);
}

TEST(Signature, FlatSegmentsHaveExtentZero) {
    Segmentation s = tenSegments();
    s.segments[0].covariance = {1.0, 0.0, 0.0, -1e-9, 0.0, 0.0};
    const auto extents = pointExtents(*makeSignature(s, {}), 0);
    EXPECT_NEAR(extents[0], 1.0, 1e-6);
    EXPECT_EQ(extents[1], 0.0);
    EXPECT_EQ(extents[2], 0.0);
    // Turned by 45 degrees about z: the extents stay.
    s.segments[0].covariance = {2.5, 1.5, 0.0, 2.5, 0.0, 0.25};
    const auto turned = pointExtents(*makeSignature(s, {}), 0);
    EXPECT_NEAR(turned[0], 2.0, 1e-6);
    EXPECT_NEAR(turned[1], 1.0, 1e-6);
    EXPECT_NEAR(turned[2], 0.5, 1e-6);
}

TEST(Signature, SameShapeComparesWhatEntersTheScore) {
    const Signature a = makeSignature(tenSegments(), {}).value();
    Signature b = a;
    b.origin = {9, 9, 9};
    b.scale = 3.0;
    EXPECT_TRUE(sameShape(a, b)) << "where and how large is not the shape";
    b.points[4].position[2] = std::nextafter(b.points[4].position[2], 1.0f);
    EXPECT_FALSE(sameShape(a, b));
    b = a;
    b.points[6].weight = std::nextafter(b.points[6].weight, 0.0f);
    EXPECT_FALSE(sameShape(a, b));
    b = a;
    b.points.pop_back();
    EXPECT_FALSE(sameShape(a, b));
}

TEST(Signature, IsWellFormedForSampledShapes) {
    for (const NamedShape& shape : namedShapes()) {
        const auto s = segment(sampleBoundary(shape.solid, 3000, 3).value(), {});
        ASSERT_TRUE(s) << shape.name;
        const auto signature = makeSignature(*s, {}).value();
        double share = 0.0;
        for (std::size_t i = 0; i < signature.points.size(); ++i) {
            const WeightedPoint& p = signature.points[i];
            EXPECT_GT(p.weight, 0.0f);
            EXPECT_LE(p.weight, signature.points[i == 0 ? 0 : i - 1].weight);
            share += p.volumeShare;
            for (const float v : p.position) EXPECT_LE(std::abs(v), 1.0f) << "inside the box";
            EXPECT_LE(p.weight, 0.2f) << "a box of diagonal 1 holds at most 3^-1.5";
        }
        EXPECT_LE(share, 1.0 + 1e-6);
    }
}

}  // namespace
}  // namespace shapedb
