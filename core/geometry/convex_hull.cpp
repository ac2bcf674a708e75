// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/geometry/convex_hull.h"

#include <algorithm>
#include <cstddef>
#include <iterator>

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/convex_hull_3.h>

namespace shapedb {

namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;

std::vector<Kernel::Point_3> toKernel(const PointCloud& points) {
    std::vector<Kernel::Point_3> copies;
    copies.reserve(points.size());
    for (const Point3& p : points) copies.emplace_back(p.x, p.y, p.z);
    return copies;
}

Point3 fromKernel(const Kernel::Point_3& p) { return {p.x(), p.y(), p.z()}; }

}  // namespace

PointCloud convexHullVertices(const PointCloud& points) {
    std::vector<Kernel::Point_3> extreme;
    CGAL::extreme_points_3(toKernel(points), std::back_inserter(extreme));
    PointCloud vertices;
    vertices.reserve(extreme.size());
    for (const auto& p : extreme) vertices.push_back(fromKernel(p));
    // CGAL's order depends on the order of the input; the result must not.
    std::sort(vertices.begin(), vertices.end(), lexicographicLess);
    return vertices;
}

std::vector<TriangleCorners> convexHullFaces(const PointCloud& points) {
    const std::vector<Kernel::Point_3> copies = toKernel(points);
    CGAL::Surface_mesh<Kernel::Point_3> hull;
    CGAL::convex_hull_3(copies.begin(), copies.end(), hull);
    std::vector<TriangleCorners> faces;
    faces.reserve(hull.number_of_faces());
    for (const auto face : hull.faces()) {
        TriangleCorners corners;
        std::size_t i = 0;
        for (const auto v : CGAL::vertices_around_face(hull.halfedge(face), hull)) {
            if (i < corners.size()) corners[i++] = fromKernel(hull.point(v));
        }
        faces.push_back(corners);
    }
    return faces;
}

}  // namespace shapedb
