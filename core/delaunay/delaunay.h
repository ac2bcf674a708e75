// SPDX-License-Identifier: GPL-3.0-or-later
// The Delaunay triangulation of a point cloud as flat arrays: the one data structure of the method.
//
// When to take it, and when CGAL's Delaunay_triangulation_3. Both find exactly the same tetrahedra. Take this
// one to triangulate a whole cloud once and then read it: it is faster, in half the memory of CGAL's cells
// and a flat copy beside them. It also uses several threads without locks, with the same bits whatever their
// number, and can be cancelled. Take CGAL's to insert or remove points later, to locate points, for weights,
// constraints or periodic space, or in exact coordinates: none of that is here.
//
// docs/delaunay.md explains the algorithm and proves what it promises. To read the code, go from here to
// cell.h, predicates.h, delaunay_ball.h, bowyer_watson.cpp, ownership.h, parallel_insertion.cpp,
// flat_delaunay.cpp.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/base/error.h"
#include "core/base/large_block.h"
#include "core/base/run_context.h"
#include "core/delaunay/hilbert_order.h"
#include "core/geometry/point.h"

namespace shapedb {

/// Neighbour index of a facet on the convex hull.
constexpr std::uint32_t kNoTetrahedron = 0xffffffffu;

/// The finite tetrahedra of Del P, structure of arrays. Facet i of a tetrahedron is the one opposite its
/// vertex i; `neighbours[t][i]` lies behind it. Vertices are positively oriented: det(v1 - v0, v2 - v0, v3 -
/// v0) > 0, the smallest index first and the smallest of the others second. Tetrahedra are sorted by the
/// first three vertices. (Smallest: in Hilbert order, if the points given were not in it.) Immutable once
/// built.
struct Tetrahedra {
    LargeVector<std::array<std::uint32_t, 4>> vertices;    ///< indices of the points given
    LargeVector<std::array<std::uint32_t, 4>> neighbours;  ///< kNoTetrahedron behind hull facets
    LargeVector<Point3> circumcentres;                     ///< Voronoi vertices
    LargeVector<double> circumradii;                       ///< of the Delaunay balls, not squared

    std::size_t size() const { return vertices.size(); }
};

/// The Delaunay triangulation of distinct, finite points, with up to as many threads as the caller's arena
/// has. Predicates are exact, and cospherical points are resolved by CGAL's symbolic perturbation, so the
/// result is unique: the same bits on any number of threads. Circumcentres are accurate to a few units in the
/// last place of the largest coordinate, unless the tetrahedron is nearly flat; a flat one's may be far off
/// but is finite.
///
/// Errors: kTooFewPoints, kCollinear, kCoplanar (decided exactly); kInternal when two points coincide;
/// kCancelled, kDeadlineExceeded; kOutOfMemory. Never throws. Thread-safe.
[[nodiscard]] Result<Tetrahedra> triangulate(const PointCloud& points, const RunContext& context = {});
/// The same tetrahedra, in the same order, for points in Hilbert order, which are not sorted again. Indices
/// are those of `sorted.points()`.
[[nodiscard]] Result<Tetrahedra> triangulate(const HilbertSortedCloud& sorted,
                                             const RunContext& context = {});

}  // namespace shapedb
