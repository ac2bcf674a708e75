// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/geometry/convex_hull.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <limits>
#include <vector>

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/convex_hull_3.h>

#include "core/geometry/box.h"
#include "core/geometry/motion.h"

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

namespace {

// With fewer points the hull itself is no dearer.
constexpr std::size_t kWorthwhile = 2000;

// The body: the convex hull of the extreme points of a sample, in this many directions.
constexpr int kDirections = 128;

// Directions are sorted into squares on the faces of a cube, this many along an edge.
constexpr std::size_t kSquares = 24;

// A point counts as inside only by this margin, a share of the body's reach: far above rounding.
constexpr double kMargin = 1e-6;

// A body with a face closer to its centre than this share of the distance to a corner is too flat to use.
constexpr double kFlattestBody = 1e-9;

PointCloud extremePoints(const PointCloud& points) {
    std::array<double, kDirections> farthest;
    std::array<std::size_t, kDirections> at{};
    std::array<Point3, kDirections> directions;
    farthest.fill(-std::numeric_limits<double>::infinity());
    for (int i = 0; i < kDirections; ++i)
        directions[static_cast<std::size_t>(i)] = evenDirection(i, kDirections);
    // The hull of a sample lies inside the hull of all points.
    const std::size_t step = std::max<std::size_t>(1, points.size() / 20000);
    for (std::size_t p = 0; p < points.size(); p += step) {
        for (std::size_t i = 0; i < directions.size(); ++i) {
            const double reach = dot(points[p], directions[i]);
            if (reach <= farthest[i]) continue;
            farthest[i] = reach;
            at[i] = p;
        }
    }
    PointCloud extreme;
    for (const std::size_t p : at) extreme.push_back(points[p]);
    return extreme;
}

// A convex body around its centre. A face is its normal over its distance from the centre, so p is
// inside when dot(face, toBody(p)) < 1 for every face. Coordinates are stretched by the body's box,
// because the grid of directions suits round bodies.
struct Body {
    Point3 centre;
    Point3 stretch;
    std::vector<Point3> faces;

    Point3 toBody(const Point3& p) const {
        const Point3 d = p - centre;
        return {stretch.x * d.x, stretch.y * d.y, stretch.z * d.z};
    }
};

// Has no faces when the points span no volume.
Body spannedBy(const PointCloud& extreme) {
    Body body;
    const Point3 extent = boxOf(extreme).extent();
    body.stretch = {1.0 / extent.x, 1.0 / extent.y, 1.0 / extent.z};
    if (!std::isfinite(squaredLength(body.stretch))) return body;
    for (const Point3& p : extreme) body.centre = body.centre + p;
    body.centre = (1.0 / static_cast<double>(extreme.size())) * body.centre;
    for (const TriangleCorners& face : convexHullFaces(extreme)) {
        TriangleCorners corners;
        for (std::size_t i = 0; i < 3; ++i) corners[i] = body.toBody(face[i]);
        const Point3 normal = cross(corners[1] - corners[0], corners[2] - corners[0]);
        const double height = dot(normal, corners[0]);
        if (!(height > kFlattestBody * length(normal) * length(corners[0])))
            return {body.centre, body.stretch, {}};
        body.faces.push_back((1.0 / height) * normal);
    }
    return body;
}

// One over the body's reach in every direction: the largest dot(face, u) for u on the cube. That is
// convex in u, so its maximum over a square of the cube lies at a corner.
class Reach {
  public:
    explicit Reach(const Body& body) : body_(body) {
        std::array<double, (kSquares + 1) * (kSquares + 1)> corners{};
        for (int face = 0; face < 6; ++face) {
            for (std::size_t i = 0; i <= kSquares; ++i) {
                for (std::size_t j = 0; j <= kSquares; ++j) {
                    corners[i * (kSquares + 1) + j] = inverseReach(face, coordinate(i), coordinate(j));
                }
            }
            for (std::size_t i = 0; i < kSquares; ++i) {
                for (std::size_t j = 0; j < kSquares; ++j) {
                    const std::size_t c = i * (kSquares + 1) + j;
                    const double near = std::max(corners[c], corners[c + 1]);
                    const double far = std::max(corners[c + kSquares + 1], corners[c + kSquares + 2]);
                    inverse_.push_back(std::max(near, far));
                }
            }
        }
    }

    bool isDeepInside(const Point3& p) const {
        const Point3 d = body_.toBody(p);
        const std::array<double, 3> v = {d.x, d.y, d.z};
        const std::size_t axis = std::abs(d.x) >= std::abs(d.y) ? (std::abs(d.x) >= std::abs(d.z) ? 0 : 2)
                                                                : (std::abs(d.y) >= std::abs(d.z) ? 1 : 2);
        const double size = std::abs(v[axis]);
        if (size == 0.0) return true;
        const std::size_t face = 2 * axis + (v[axis] < 0.0 ? 1 : 0);
        const std::size_t i = square(v[(axis + 1) % 3] / size);
        const std::size_t j = square(v[(axis + 2) % 3] / size);
        return size * inverse_[(face * kSquares + i) * kSquares + j] < 1.0 - kMargin;
    }

  private:
    static double coordinate(std::size_t i) {
        return 2.0 * static_cast<double>(i) / static_cast<double>(kSquares) - 1.0;
    }
    static std::size_t square(double v) {
        const double at = 0.5 * (v + 1.0) * static_cast<double>(kSquares);
        return std::min(kSquares - 1, static_cast<std::size_t>(std::max(0.0, at)));
    }

    double inverseReach(int face, double second, double third) const {
        std::array<double, 3> u{};
        const auto axis = static_cast<std::size_t>(face / 2);
        u[axis] = face % 2 == 0 ? 1.0 : -1.0;
        u[(axis + 1) % 3] = second;
        u[(axis + 2) % 3] = third;
        double largest = 0.0;
        for (const Point3& f : body_.faces) {
            largest = std::max(largest, f.x * u[0] + f.y * u[1] + f.z * u[2]);
        }
        return largest;
    }

    const Body& body_;
    std::vector<double> inverse_;
};

}  // namespace

PointCloud cullHullInterior(const PointCloud& points) {
    if (points.size() < kWorthwhile) return points;
    const Body body = spannedBy(extremePoints(points));
    if (body.faces.size() < 4) return points;
    const Reach reach(body);
    PointCloud outer;
    for (const Point3& p : points) {
        if (!reach.isDeepInside(p)) outer.push_back(p);
    }
    return outer;
}

}  // namespace shapedb
