// How tightly the shape encloses each Delaunay ball: the walk of Section 2 for all angles at once.
#pragma once

#include <cstdint>
#include <vector>

#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/delaunay/delaunay.h"
#include "core/geometry/point.h"

namespace shapedb {

/// The cosine of the angle at which the balls of the two tetrahedra at a facet meet, in [-1, 1]:
/// near 1 when they are nearly the same ball. Beyond a hull facet lies the half space outside, a
/// ball without end, so both kinds of facet are judged alike.
[[nodiscard]] double facetCosine(const PointCloud& points, const Tetrahedra& tetrahedra,
                                 std::size_t tetrahedron, std::size_t facet);

/// Per tetrahedron the leak angle, radians in [0, pi]: over all paths from outside through big
/// balls, the smallest of the largest angle on the path. A walk with deep angle theta reaches exactly
/// the big balls with a leak angle below theta. Infinity where no path leads; so for every ball
/// that is not big.
///
/// Errors: kCancelled, kDeadlineExceeded.
[[nodiscard]] Result<std::vector<double>> bottleneckAngles(const PointCloud& points,
                                                           const Tetrahedra& tetrahedra,
                                                           const std::vector<std::uint8_t>& big,
                                                           const RunContext& context = {});

}  // namespace shapedb
