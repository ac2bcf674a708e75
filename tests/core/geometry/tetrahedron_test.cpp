// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/geometry/tetrahedron.h"

#include <array>
#include <cmath>
#include <cstdint>

#include <gtest/gtest.h>

namespace shapedb {
namespace {

TEST(ExactCircumcentre, AgreesWithTetrahedraSolvedByHand) {
    EXPECT_EQ(exactCircumcentre({{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}), (Point3{0.5, 0.5, 0.5}));
    EXPECT_EQ(exactCircumcentre({{{1, 1, 1}, {-1, -1, 1}, {-1, 1, -1}, {1, -1, -1}}}), (Point3{0, 0, 0}));
    // Nearly flat: a square of side 2 with one corner lifted by h. Three corners give x = y = 0, the fourth
    // the height: 2 + (h - z)^2 = 2 + z^2, so z = h / 2.
    const Point3 centre = exactCircumcentre({{{1, 1, 0}, {-1, 1, 0}, {-1, -1, 0}, {1, -1, 0x1p-40}}});
    EXPECT_EQ(centre, (Point3{0, 0, 0x1p-41}));
}

TEST(ExactFlowMask, MarksTheFacetsTheCircumcentreLiesBeyond) {
    // Inside a regular tetrahedron; beyond the long facet of a corner of a cube.
    EXPECT_EQ(exactFlowMask({{{1, 1, 1}, {-1, 1, -1}, {-1, -1, 1}, {1, -1, -1}}}), 0U);
    EXPECT_EQ(exactFlowMask({{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}), 1U);
    // A centre exactly in the plane of a facet is not beyond it.
    EXPECT_EQ(exactFlowMask({{{-1, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}), 0U);
    EXPECT_EQ(exactFlowMask({{{-1, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, std::nextafter(1.0, 2.0)}}}) & 8U, 0U);
    EXPECT_EQ(exactFlowMask({{{-1, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, std::nextafter(1.0, 0.0)}}}), 8U);
}

// A corner of a box of sides 2, 3 and 6, not at the origin.
TEST(Tetrahedron, MeasuresOfAKnownOne) {
    const PointCloud points = {{1, 1, 1}, {3, 1, 1}, {1, 4, 1}, {1, 1, 7}};
    const std::array<std::uint32_t, 4> vertices = {0, 1, 2, 3};
    const TetrahedronCorners corners = cornersOf(points, vertices);
    EXPECT_EQ(sixfoldVolume(corners), 36.0);
    EXPECT_EQ(signedVolume(corners), 6.0);
    EXPECT_EQ(signedVolume({corners[1], corners[0], corners[2], corners[3]}), -6.0);
    EXPECT_EQ(centroidOf(corners), (Point3{1.5, 1.75, 2.5}));
    const TriangleCorners base = facetCorners(points, vertices, 3);
    EXPECT_EQ(base, (TriangleCorners{points[0], points[1], points[2]}));
    EXPECT_EQ(areaOf(base), 3.0);
    EXPECT_DOUBLE_EQ(circumradiusOf(base), 0.5 * std::sqrt(13.0));
    EXPECT_TRUE(std::isinf(circumradiusOf({points[0], points[1], {2, 1, 1}})));
    // The order of the corners does not matter to where outside is.
    EXPECT_EQ(outwardNormal(points, vertices, 3), (Point3{0, 0, -1}));
    EXPECT_EQ(outwardNormal(points, {1, 0, 2, 3}, 0), (Point3{-1, 0, 0}));
}

}  // namespace
}  // namespace shapedb
