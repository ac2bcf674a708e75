// SPDX-License-Identifier: GPL-3.0-or-later
// Measures of single tetrahedra and their facets. Facet i is the one opposite corner i.
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>

#include "core/geometry/point.h"

namespace shapedb {

using TetrahedronCorners = std::array<Point3, 4>;
using TriangleCorners = std::array<Point3, 3>;

[[nodiscard]] inline TetrahedronCorners cornersOf(const PointCloud& points,
                                                  const std::array<std::uint32_t, 4>& vertices) {
    return {points[vertices[0]], points[vertices[1]], points[vertices[2]], points[vertices[3]]};
}

/// The corners i + 1, i + 2, i + 3 (modulo 4), in this order.
[[nodiscard]] inline TriangleCorners facetCorners(const PointCloud& points,
                                                  const std::array<std::uint32_t, 4>& vertices,
                                                  std::size_t i) {
    return {points[vertices[(i + 1) % 4]], points[vertices[(i + 2) % 4]], points[vertices[(i + 3) % 4]]};
}

/// Six times the volume; positive when the corners are positively oriented.
[[nodiscard]] inline double sixfoldVolume(const TetrahedronCorners& p) {
    return dot(p[1] - p[0], cross(p[2] - p[0], p[3] - p[0]));
}
[[nodiscard]] inline double signedVolume(const TetrahedronCorners& p) { return sixfoldVolume(p) / 6.0; }

[[nodiscard]] inline Point3 centroidOf(const TetrahedronCorners& p) {
    return 0.25 * (p[0] + p[1] + p[2] + p[3]);
}

[[nodiscard]] inline double areaOf(const TriangleCorners& p) {
    return 0.5 * length(cross(p[1] - p[0], p[2] - p[0]));
}

/// Of the circle through the corners; infinite when they lie on a line.
[[nodiscard]] inline double circumradiusOf(const TriangleCorners& p) {
    const Point3 a = p[1] - p[0];
    const Point3 b = p[2] - p[0];
    return length(a) * length(b) * length(a - b) / (2.0 * length(cross(a, b)));
}

/// Normal of facet i, of unit length, pointing away from corner i; zero when the facet has no area.
[[nodiscard]] inline Point3 outwardNormal(const PointCloud& points,
                                          const std::array<std::uint32_t, 4>& vertices, std::size_t i) {
    const TriangleCorners p = facetCorners(points, vertices, i);
    const Point3 normal = cross(p[1] - p[0], p[2] - p[0]);
    const double size = length(normal);
    const double sign = dot(normal, points[vertices[i]] - p[0]) > 0.0 ? -1.0 : 1.0;
    return size > 0.0 ? (sign / size) * normal : Point3{};
}

// Exact answers for the few tetrahedra that double precision cannot decide: flat ones, and those whose
// circumcentre lies (nearly) in the plane of a facet. The corners must be positively oriented and not
// exactly flat.

/// Computed with rational numbers, rounded once.
[[nodiscard]] Point3 exactCircumcentre(const TetrahedronCorners& corners);

/// Bit i is set when the circumcentre lies strictly beyond facet i.
[[nodiscard]] unsigned exactFlowMask(const TetrahedronCorners& corners);

}  // namespace shapedb
