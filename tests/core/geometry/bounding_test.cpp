// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/geometry/bounding.h"

#include <algorithm>
#include <cmath>
#include <string>

#include <gtest/gtest.h>

#include "core/geometry/motion.h"
#include "core/synthetic/families.h"
#include "core/synthetic/named_shapes.h"

namespace shapedb {
namespace {

PointCloud boxCorners(const Point3& half) {
    PointCloud points;
    for (const double x : {-half.x, half.x}) {
        for (const double y : {-half.y, half.y}) {
            for (const double z : {-half.z, half.z}) points.push_back({x, y, z});
        }
    }
    return points;
}

TEST(SmallestBoxDiagonal, IsKnownForBoxesInAnyPose) {
    Random random(3);
    for (int turn = 0; turn < 10; ++turn) {
        Motion motion;
        motion.rotation = randomRotation(random);
        motion.translation = {1, -2, 3};
        for (const Point3& half : {Point3{1, 0.7, 0.5}, Point3{1, 1, 1}, Point3{3, 0.1, 0.2}}) {
            const double diagonal = 2.0 * length(half);
            EXPECT_NEAR(*smallestBoxDiagonal(applyToCloud(motion, boxCorners(half))), diagonal,
                        1e-3 * diagonal);
        }
    }
    // A regular tetrahedron of edge sqrt(8) fits the cube of side 2.
    EXPECT_NEAR(*smallestBoxDiagonal({{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}}), std::sqrt(12.0),
                4e-3);
}

TEST(SmallestBoxDiagonal, HandlesFewAndFlatPoints) {
    EXPECT_EQ(smallestBoxDiagonal({}).error().code, ErrorCode::kInvalidArgument);
    EXPECT_EQ(*smallestBoxDiagonal({{1, 2, 3}}), 0.0);
    EXPECT_EQ(*smallestBoxDiagonal(PointCloud(5, {1, 2, 3})), 0.0);
    EXPECT_NEAR(*smallestBoxDiagonal({{0, 0, 0}, {2, 1, 2}}), 3.0, 1e-3);
    EXPECT_NEAR(*smallestBoxDiagonal({{0, 0, 0}, {2, 1, 2}, {4, 2, 4}}), 6.0, 1e-3);
    EXPECT_NEAR(*smallestBoxDiagonal({{0, 0, 0}, {3, 0, 0}, {0, 4, 0}, {3, 4, 0}}), 5.0, 5e-3);
}

TEST(SmallestBoxDiagonal, LiesBetweenDiameterAndAxisAlignedBox) {
    for (const NamedShape& shape : namedShapes()) {
        const PointCloud points = sampleBoundary(shape.solid, 600, 4).value();
        double widest = 0.0;
        for (const Point3& p : points) {
            for (const Point3& q : points) widest = std::max(widest, distance(p, q));
        }
        const double diagonal = *smallestBoxDiagonal(points);
        EXPECT_GE(diagonal, widest * (1 - 1e-12)) << shape.name;
        EXPECT_LE(diagonal, boundsOf(shape.solid).diagonal() * 1.001) << shape.name;
    }
}

TEST(SmallestBoxDiagonal, ScalesExactlyByPowersOfTwoAndIgnoresOrder) {
    const PointCloud points = sampleBoundary(makeLShape().solid, 500, 5).value();
    PointCloud other(points.rbegin(), points.rend());
    const double diagonal = *smallestBoxDiagonal(points);
    EXPECT_EQ(*smallestBoxDiagonal(other), diagonal);
    for (Point3& p : other) p = 0x1p20 * p;
    EXPECT_EQ(*smallestBoxDiagonal(other), 0x1p20 * diagonal);
}

// The search has fixed starts, so rotating the points may change the result, but by less than a signature
// may move.
TEST(SmallestBoxDiagonal, HardlyChangesUnderRotation) {
    Random random(7);
    for (const FamilyInfo& family : listFamilies()) {
        ScanOptions options;
        options.count = 3000;
        options.randomPose = false;
        const PointCloud points = scanOf(makeMember(family.name, 1, 5).value(), options).value();
        double low = INFINITY;
        double high = 0.0;
        for (int turn = 0; turn < 4; ++turn) {
            Motion motion;
            motion.rotation = randomRotation(random);
            const double diagonal = *smallestBoxDiagonal(applyToCloud(motion, points));
            low = std::min(low, diagonal);
            high = std::max(high, diagonal);
        }
        EXPECT_LT(high / low - 1.0, 1e-3) << family.name;
    }
}

}  // namespace
}  // namespace shapedb
