#include "core/geometry/tetrahedron.h"

#include <cmath>

#include <gtest/gtest.h>

namespace shapedb {
namespace {

TEST(ExactGeometry, CircumcentreOfKnownTetrahedra) {
    EXPECT_EQ(exactCircumcentre({{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}), (Point3{0.5, 0.5, 0.5}));
    EXPECT_EQ(exactCircumcentre({{{1, 1, 1}, {-1, -1, 1}, {-1, 1, -1}, {1, -1, -1}}}), (Point3{0, 0, 0}));
    // Thin: three corners of a square of side 2 fix the axis x = y = 0; the fourth, lifted by h, the
    // height: 2 + (h - z)^2 = 2 + z^2 gives z = h / 2.
    const Point3 centre = exactCircumcentre({{{1, 1, 0}, {-1, 1, 0}, {-1, -1, 0}, {1, -1, 0x1p-40}}});
    EXPECT_EQ(centre, (Point3{0, 0, 0x1p-41}));
}

TEST(ExactGeometry, FlowOfKnownTetrahedra) {
    // The centre lies inside a regular one, and beyond the long facet of a corner of a box.
    EXPECT_EQ(exactFlowMask({{{1, 1, 1}, {-1, 1, -1}, {-1, -1, 1}, {1, -1, -1}}}), 0U);
    EXPECT_EQ(exactFlowMask({{{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}), 1U);
    // A centre exactly in the plane of a facet is not beyond it.
    EXPECT_EQ(exactFlowMask({{{-1, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}), 0U);
    EXPECT_EQ(exactFlowMask({{{-1, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, std::nextafter(1.0, 2.0)}}}) & 8U, 0U);
    EXPECT_EQ(exactFlowMask({{{-1, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, std::nextafter(1.0, 0.0)}}}), 8U);
}

}  // namespace
}  // namespace shapedb
