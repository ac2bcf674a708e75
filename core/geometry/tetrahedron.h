// Exact answers for the few tetrahedra that double precision cannot decide: flat ones and
// those whose circumcentre lies (nearly) in the plane of a facet.
#pragma once

#include <array>
#include <cstdint>

#include "core/geometry/point.h"

namespace shapedb {

/// Four vertices of a positively oriented, exactly non-flat tetrahedron.
using TetrahedronCorners = std::array<Point3, 4>;

[[nodiscard]] inline TetrahedronCorners cornersOf(const PointCloud& points,
                                                  const std::array<std::uint32_t, 4>& vertices) {
    return {points[vertices[0]], points[vertices[1]], points[vertices[2]], points[vertices[3]]};
}

/// Circumcentre computed with rational numbers, rounded once.
[[nodiscard]] Point3 exactCircumcentre(const TetrahedronCorners& corners);

/// Bit i is set when the circumcentre lies strictly beyond facet i (opposite corner i).
[[nodiscard]] unsigned exactFlowMask(const TetrahedronCorners& corners);

}  // namespace shapedb
