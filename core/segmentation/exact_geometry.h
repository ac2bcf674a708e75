// Exact answers for the few tetrahedra that double precision cannot decide: flat ones and
// those whose circumcentre lies (nearly) in the plane of a facet.
#pragma once

#include <array>

#include "core/geometry/point.h"

namespace shapedb {

/// Four vertices of a positively oriented, exactly non-flat tetrahedron.
using TetrahedronCorners = std::array<Point3, 4>;

/// Circumcentre computed with rational numbers, rounded once.
[[nodiscard]] Point3 exactCircumcentre(const TetrahedronCorners& corners);

/// Bit i is set when the circumcentre lies strictly beyond facet i (opposite corner i).
[[nodiscard]] unsigned exactFlowMask(const TetrahedronCorners& corners);

}  // namespace shapedb
