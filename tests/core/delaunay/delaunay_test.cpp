// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/delaunay/delaunay.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <set>
#include <string>

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <gtest/gtest.h>

#include "core/base/random.h"
#include "core/geometry/convex_hull.h"
#include "tests/core/segmentation/exact_balls.h"

namespace shapedb {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;

Kernel::Point_3 filtered(const Point3& p) { return {p.x, p.y, p.z}; }

ExactNumber sixVolumes(const ExactPoint& a, const ExactPoint& b, const ExactPoint& c, const ExactPoint& d) {
    return CGAL::determinant(b - a, c - a, d - a);
}

// Six times the volume of the convex hull, from its surface alone.
ExactNumber hullSixVolumes(const PointCloud& cloud) {
    ExactNumber sum = 0;
    const ExactPoint origin(0, 0, 0);
    for (const TriangleCorners& face : convexHullFaces(cloud)) {
        sum += sixVolumes(origin, exact(face[0]), exact(face[1]), exact(face[2]));
    }
    return sum;
}

TEST(Delaunay, BallsAreEmptyOfPoints) {
    for (const Triangulated& cloud : triangulatedClouds()) {
        std::vector<Kernel::Point_3> points;
        for (const Point3& p : cloud.points) points.push_back(filtered(p));
        std::size_t inside = 0;
        for (const auto& v : cloud.tetrahedra.vertices) {
            for (const auto& q : points) {
                inside += CGAL::side_of_bounded_sphere(points[v[0]], points[v[1]], points[v[2]], points[v[3]],
                                                       q) == CGAL::ON_BOUNDED_SIDE;
            }
        }
        EXPECT_EQ(inside, 0U) << cloud.name;
    }
}

TEST(Delaunay, TetrahedraFillTheConvexHullExactly) {
    for (const Triangulated& cloud : triangulatedClouds()) {
        ExactNumber sum = 0;
        std::size_t notPositive = 0;
        for (std::size_t t = 0; t < cloud.tetrahedra.size(); ++t) {
            const auto p = exactCorners(cloud, t);
            const ExactNumber volume = sixVolumes(p[0], p[1], p[2], p[3]);
            notPositive += volume <= 0;
            sum += volume;
        }
        EXPECT_EQ(notPositive, 0U) << cloud.name;
        EXPECT_EQ(sum, hullSixVolumes(cloud.points)) << cloud.name;
    }
}

TEST(Delaunay, UsesEveryPoint) {
    for (const Triangulated& cloud : triangulatedClouds()) {
        std::set<std::uint32_t> used;
        for (const auto& v : cloud.tetrahedra.vertices) used.insert(v.begin(), v.end());
        EXPECT_EQ(used.size(), cloud.points.size()) << cloud.name;
        EXPECT_LT(*used.rbegin(), cloud.points.size()) << cloud.name;
    }
}

TEST(Delaunay, NeighboursAreSymmetricAndOppositeTheirVertex) {
    for (const Triangulated& cloud : triangulatedClouds()) {
        const Tetrahedra& flat = cloud.tetrahedra;
        ASSERT_EQ(flat.neighbours.size(), flat.size());
        std::size_t wrong = 0;
        for (std::uint32_t t = 0; t < flat.size(); ++t) {
            for (std::size_t i = 0; i < 4; ++i) {
                const std::uint32_t next = flat.neighbours[t][i];
                if (next == kNoTetrahedron) continue;
                std::set<std::uint32_t> facet(flat.vertices[t].begin(), flat.vertices[t].end());
                facet.erase(flat.vertices[t][i]);
                const auto& back = flat.neighbours[next];
                const auto at = std::find(back.begin(), back.end(), t);
                if (at == back.end()) {
                    ++wrong;
                    continue;
                }
                std::set<std::uint32_t> other(flat.vertices[next].begin(), flat.vertices[next].end());
                other.erase(flat.vertices[next][static_cast<std::size_t>(at - back.begin())]);
                wrong += facet != other;
            }
        }
        EXPECT_EQ(wrong, 0U) << cloud.name;
    }
}

TEST(Delaunay, HullFacetsAreThoseWithoutNeighbour) {
    for (const Triangulated& cloud : triangulatedClouds()) {
        const Tetrahedra& flat = cloud.tetrahedra;
        std::size_t hullFacets = 0;
        for (std::size_t t = 0; t < flat.size(); ++t) {
            const auto corners = cornersOf(cloud, t);
            for (std::size_t i = 0; i < 4; ++i) {
                if (flat.neighbours[t][i] != kNoTetrahedron) continue;
                ++hullFacets;
                const auto a = filtered(corners[(i + 1) % 4]);
                const auto b = filtered(corners[(i + 2) % 4]);
                const auto c = filtered(corners[(i + 3) % 4]);
                const auto inwards = CGAL::orientation(a, b, c, filtered(corners[i]));
                const bool beyond =
                    std::any_of(cloud.points.begin(), cloud.points.end(), [&](const Point3& p) {
                        return CGAL::orientation(a, b, c, filtered(p)) == CGAL::opposite(inwards);
                    });
                ASSERT_FALSE(beyond) << cloud.name;
            }
        }
        EXPECT_GE(hullFacets, 4U) << cloud.name;
        EXPECT_EQ(hullFacets % 2, 0U) << "a closed triangulated surface has an even number of triangles";
    }
}

TEST(Delaunay, BallsAgreeWithRationalArithmetic) {
    for (const Triangulated& cloud : triangulatedClouds()) {
        for (std::size_t t = 0; t < cloud.tetrahedra.size(); ++t) {
            const auto p = exactCorners(cloud, t);
            const ExactPoint centre = exactCentre(cloud, t);
            const double radius = std::sqrt(CGAL::to_double(CGAL::squared_distance(centre, p[0])));
            const double off = std::sqrt(
                CGAL::to_double(CGAL::squared_distance(centre, exact(cloud.tetrahedra.circumcentres[t]))));
            // The digits lost: product of the edges at a corner over six volumes.
            const auto c = cornersOf(cloud, t);
            const double box = distance(c[0], c[1]) * distance(c[0], c[2]) * distance(c[0], c[3]);
            const double loss = box / CGAL::to_double(sixVolumes(p[0], p[1], p[2], p[3]));
            const double digits = loss > 1e9 ? 4e-16 : 4e-15 * loss;
            ASSERT_LE(off, 4e-16 + digits * radius) << cloud.name << " loss " << loss;
            ASSERT_NEAR(cloud.tetrahedra.circumradii[t], radius, 4e-16 + (digits + 1e-14) * radius)
                << cloud.name;
        }
    }
}

TEST(Delaunay, FlatTetrahedraHaveFiniteAccurateBalls) {
    for (const double height : {1e-6, 1e-9, 1e-12, 0x1p-52}) {
        Triangulated one{"flat", {{0, 0, 0}, {0.75, 0.125, 0}, {0.25, 0.875, 0}, {0.5, 0.25, height}}, {}};
        const auto flat = triangulate(one.points);
        ASSERT_TRUE(flat);
        ASSERT_EQ(flat->size(), 1U);
        one.tetrahedra = *flat;
        const ExactPoint centre = exactCentre(one, 0);
        const double radius =
            std::sqrt(CGAL::to_double(CGAL::squared_distance(centre, exact(one.points[0]))));
        EXPECT_GT(radius, 0.01 / height);
        EXPECT_NEAR(flat->circumradii[0], radius, 1e-6 * radius) << height;
        EXPECT_TRUE(std::isfinite(length(flat->circumcentres[0])));
    }
}

TEST(Delaunay, RefusesPointsThatSpanNoSpace) {
    const PointCloud three = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    EXPECT_EQ(triangulate({}).error().code, ErrorCode::kTooFewPoints);
    EXPECT_EQ(triangulate(three).error().code, ErrorCode::kTooFewPoints);
    PointCloud line;
    PointCloud plane;
    for (int i = 0; i < 20; ++i) {
        line.push_back({i * 0.03125, i * 0.015625, i * 0.0625});
        plane.push_back({(i % 5) * 0.125, (i / 5) * 0.25, 0.5});
    }
    EXPECT_EQ(triangulate(line).error().code, ErrorCode::kCollinear);
    EXPECT_EQ(triangulate(plane).error().code, ErrorCode::kCoplanar);
}

TEST(Delaunay, RefusesRepeatedPoints) {
    EXPECT_EQ(triangulate({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 0}}).error().code,
              ErrorCode::kInternal);
}

TEST(Delaunay, StopsWhenCancelledOrLate) {
    PointCloud points;
    Random random(4);
    for (int i = 0; i < 50000; ++i) points.push_back({random.uniform(), random.uniform(), random.uniform()});
    std::atomic<bool> cancel{false};
    RunContext context;
    context.cancel = &cancel;
    std::uint64_t last = 0;
    context.progress = [&](const char* stage, std::uint64_t done, std::uint64_t total) {
        EXPECT_STREQ(stage, "delaunay");
        EXPECT_EQ(total, points.size());
        EXPECT_GE(done, last);
        last = done;
        if (done > 10000) cancel = true;
    };
    EXPECT_EQ(triangulate(points, context).error().code, ErrorCode::kCancelled);
    EXPECT_LT(last, 20000U);

    RunContext late;
    late.deadline = RunContext::Clock::now() + std::chrono::milliseconds(10);
    EXPECT_EQ(triangulate(points, late).error().code, ErrorCode::kDeadlineExceeded);
}

}  // namespace
}  // namespace shapedb
