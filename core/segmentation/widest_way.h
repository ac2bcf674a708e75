// How webs are peeled off an interior: by the widest way that leads to each tetrahedron from outside.
#pragma once

#include <cstdint>
#include <vector>

#include "core/delaunay/delaunay.h"
#include "core/geometry/point.h"

namespace shapedb {

/// Per tetrahedron of `inside` the width, in spacings, of the narrowest facet on the way from outside on
/// which it is widest (a maximin path): peeling through facets wider than w takes exactly those above w.
/// Minus infinity elsewhere.
[[nodiscard]] std::vector<double> widestWays(const PointCloud& points, const Tetrahedra& tetrahedra,
                                             const std::vector<double>& spacings,
                                             const std::vector<std::uint8_t>& inside);

}  // namespace shapedb
