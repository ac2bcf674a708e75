// SPDX-License-Identifier: GPL-3.0-or-later
// The walk of Section 2 for all angles at once: how tightly the shape encloses each Delaunay ball.
#pragma once

#include <cstdint>
#include <vector>

#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/delaunay/delaunay.h"
#include "core/geometry/point.h"

namespace shapedb {

/// The cosine of the angle at which the balls on both sides of a facet meet, in [-1, 1]: near 1 when they
/// are nearly the same. Behind a hull facet lies the half space outside, taken as an infinite ball.
[[nodiscard]] double facetCosine(const PointCloud& points, const Tetrahedra& tetrahedra,
                                 std::size_t tetrahedron, std::size_t facet);

/// Per tetrahedron, radians in [0, pi]: the largest angle on the path from outside through big balls on
/// which it is smallest (a minimax path). A walk with deep angle theta reaches exactly the big balls whose
/// bottleneck angle is below theta. Infinite where no path leads, as for every ball that is not big.
///
/// Errors: kCancelled, kDeadlineExceeded.
[[nodiscard]] Result<std::vector<double>> bottleneckAngles(const PointCloud& points,
                                                           const Tetrahedra& tetrahedra,
                                                           const std::vector<std::uint8_t>& big,
                                                           const RunContext& context = {});

// How webs are peeled off an interior: by the widest way that leads to each tetrahedron from outside.

/// For each tetrahedron of `inside`: of all ways to it from outside, the one whose narrowest facet is widest
/// (a maximin path), and the width of that facet in spacings. Peeling through facets wider than w removes
/// exactly the tetrahedra with a value above w. Minus infinity for all others.
[[nodiscard]] std::vector<double> widestWays(const PointCloud& points, const Tetrahedra& tetrahedra,
                                             const std::vector<double>& spacings,
                                             const std::vector<std::uint8_t>& inside);

}  // namespace shapedb
