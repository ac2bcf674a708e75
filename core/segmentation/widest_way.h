// SPDX-License-Identifier: GPL-3.0-or-later
// How webs are peeled off an interior: by the widest way that leads to each tetrahedron from outside.
#pragma once

#include <cstdint>
#include <vector>

#include "core/delaunay/delaunay.h"
#include "core/geometry/point.h"

namespace shapedb {

/// For each tetrahedron of `inside`: of all ways to it from outside, the one whose narrowest facet is widest
/// (a maximin path), and the width of that facet in spacings. Peeling through facets wider than w removes
/// exactly the tetrahedra with a value above w. Minus infinity for all others.
[[nodiscard]] std::vector<double> widestWays(const PointCloud& points, const Tetrahedra& tetrahedra,
                                             const std::vector<double>& spacings,
                                             const std::vector<std::uint8_t>& inside);

}  // namespace shapedb
