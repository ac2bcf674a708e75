// The one data structure of the method: the Delaunay triangulation as flat arrays.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/base/error.h"
#include "core/base/large_block.h"
#include "core/base/run_context.h"
#include "core/geometry/point.h"

namespace shapedb {

/// Neighbour index of a facet on the convex hull.
constexpr std::uint32_t kNoTetrahedron = 0xffffffffu;

/// The finite tetrahedra of Del P, structure of arrays. Facet i of a tetrahedron is the one
/// opposite its vertex i; `neighbours[t][i]` lies behind it. Vertices are positively oriented:
/// det(v1 - v0, v2 - v0, v3 - v0) > 0. Immutable once built.
struct Tetrahedra {
    LargeVector<std::array<std::uint32_t, 4>> vertices;    ///< indices of the points given
    LargeVector<std::array<std::uint32_t, 4>> neighbours;  ///< kNoTetrahedron behind hull facets
    LargeVector<Point3> circumcentres;                     ///< Voronoi vertices
    LargeVector<double> circumradii;                       ///< of the Delaunay balls, not squared

    std::size_t size() const { return vertices.size(); }
};

enum class PointOrder {
    kAny,
    kHilbert,  ///< that of hilbertOrder, which then is not looked for again; the result is the same
};

/// Delaunay triangulation of distinct, finite points (CGAL's exact predicates; cospherical
/// points are resolved by CGAL's symbolic perturbation, so the result is unique).
/// Circumcentres are accurate to a few units in the last place of the largest coordinate
/// unless the tetrahedron is nearly flat; a flat one's may lie far off but is finite.
///
/// Errors: kTooFewPoints, kCollinear, kCoplanar (exactly so), kCancelled,
/// kDeadlineExceeded, kOutOfMemory, kInternal.
[[nodiscard]] Result<Tetrahedra> triangulate(const PointCloud& points, const RunContext& context = {},
                                             PointOrder order = PointOrder::kAny);

}  // namespace shapedb
