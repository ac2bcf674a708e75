// SPDX-License-Identifier: GPL-3.0-or-later
// The convex hull of a point cloud. CGAL's, behind a header of our own: it takes long to compile.
#pragma once

#include <vector>

#include "core/geometry/point.h"
#include "core/geometry/tetrahedron.h"

namespace shapedb {

/// The hull's vertices in lexicographic order, each once. Points inside a face or an edge are not
/// vertices. Exact: no vertex is lost to rounding. Points on a line or plane are allowed.
/// Throws std::bad_alloc and what CGAL throws: callers translate (core/geometry/bounding.h).
[[nodiscard]] PointCloud convexHullVertices(const PointCloud& points);

/// The hull's faces, as triangles counterclockwise seen from outside. The points must not all lie in
/// one plane. Throws as above.
[[nodiscard]] std::vector<TriangleCorners> convexHullFaces(const PointCloud& points);

/// Drops points that cannot lie on the convex hull, in linear time: returns the points, in order, without
/// those that certainly lie inside the convex hull of the rest. Every hull vertex stays; of a scan usually
/// only a small share does.
[[nodiscard]] PointCloud cullHullInterior(const PointCloud& points);

}  // namespace shapedb
