// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/signature/interior_view.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

#include <gtest/gtest.h>

#include "core/delaunay/delaunay.h"
#include "core/pipeline.h"
#include "core/synthetic/named_shapes.h"
#include "tests/core/signature/cube_views.h"

namespace shapedb {
namespace {

using testing_support::randomPointIn;

Segmentation segmented(const NamedShape& shape) {
    const PointCloud points = sampleBoundary(shape.solid, 3000, 2).value();
    return segment(points, parametersOf(Profile::kDefault).segmentation).value();
}

TEST(InteriorView, IsInThePrincipalFrameAndUnit) {
    const NamedShape box = makeBox();
    const Segmentation s = segmented(box);
    const InteriorView view = interiorView(s);
    EXPECT_NEAR(view.volume, s.volume / std::pow(s.size, 3), 1e-9);
    ASSERT_EQ(view.sites.size(), s.sites.size());
    for (std::size_t i = 1; i < view.sites.size(); ++i) {
        EXPECT_NEAR(distance(view.sites[i - 1], view.sites[i]) * s.size, distance(s.sites[i - 1], s.sites[i]),
                    1e-9);
    }
    Point3 centre;
    std::array<double, 3> spread{};
    std::array<double, 3> mixed{};
    for (std::size_t t = 0; t < view.volumes.size(); ++t) {
        centre = centre + (view.volumes[t] / view.volume) * view.centroids[t];
    }
    EXPECT_LT(length(centre), 1e-9);
    Random random(1);
    for (std::uint32_t t = 0; t < view.vertices.size(); ++t) {
        const Point3 p = randomPointIn(view, t, random);
        const double share = view.volumes[t] / view.volume;
        spread[0] += share * p.x * p.x;
        spread[1] += share * p.y * p.y;
        spread[2] += share * p.z * p.z;
        mixed[0] += share * p.x * p.y;
        mixed[1] += share * p.x * p.z;
        mixed[2] += share * p.y * p.z;
    }
    // The variances of a box: a twelfth of the square of each side.
    const std::array<double, 3> sides{2.0, 1.4, 1.0};
    for (std::size_t axis = 0; axis < 3; ++axis) {
        EXPECT_NEAR(spread[axis] * s.size * s.size * 12.0 / (sides[axis] * sides[axis]), 1.0, 0.12);
        EXPECT_LT(std::abs(mixed[axis]), 0.1 * spread[2]);
    }
}

TEST(InteriorView, HoldsTheInteriorTetrahedraOnly) {
    const Segmentation s = segmented(makeJack());
    const InteriorView view = interiorView(s);
    const auto inside = std::count_if(s.tetrahedronSegment.begin(), s.tetrahedronSegment.end(),
                                      [](std::int32_t segment) { return segment >= 0; });
    ASSERT_EQ(view.vertices.size(), static_cast<std::size_t>(inside));
    ASSERT_EQ(view.neighbours.size(), view.vertices.size());
    ASSERT_EQ(view.radii.size(), view.vertices.size());
    double radius = 0.0;
    for (std::uint32_t t = 0; t < view.vertices.size(); ++t) {
        const auto& v = view.vertices[t];
        EXPECT_GT(view.radii[t], 0.0);
        EXPECT_LE(view.radii[t], 1.0);
        const Point3& a = view.sites[v[0]];
        const double six = dot(view.sites[v[1]] - a, cross(view.sites[v[2]] - a, view.sites[v[3]] - a));
        EXPECT_NEAR(view.volumes[t], std::abs(six) / 6.0, 1e-15);
        radius += view.volumes[t] / view.volume * length(view.centroids[t]);
        for (std::size_t f = 0; f < 4; ++f) {
            const std::uint32_t other = view.neighbours[t][f];
            if (other == kNoTetrahedron) continue;
            ASSERT_LT(other, view.vertices.size());
            const auto& back = view.neighbours[other];
            EXPECT_NE(std::find(back.begin(), back.end(), t), back.end());
            for (std::size_t corner = 0; corner < 4; ++corner) {
                const auto& w = view.vertices[other];
                EXPECT_EQ(std::find(w.begin(), w.end(), v[corner]) != w.end(), corner != f);
            }
        }
    }
    EXPECT_NEAR(view.meanRadius, radius, 1e-12);
}

TEST(InteriorView, ListsTheSurfaceAndItsMeanDistance) {
    const Segmentation s = segmented(makeDumbbell());
    const InteriorView view = interiorView(s);
    std::set<std::array<double, 3>> touched, surface;
    for (const auto& v : view.vertices) {
        for (const std::uint32_t site : v) {
            touched.insert({view.sites[site].x, view.sites[site].y, view.sites[site].z});
        }
    }
    for (const Point3& p : view.surface) surface.insert({p.x, p.y, p.z});
    EXPECT_EQ(surface, touched);
    EXPECT_EQ(view.surface.size(), touched.size()) << "each once";
    double sum = 0.0;
    double pairs = 0.0;
    for (std::size_t i = 0; i < view.surface.size(); i += 3) {
        for (std::size_t j = 0; j < i; j += 2, pairs += 1.0)
            sum += distance(view.surface[i], view.surface[j]);
    }
    EXPECT_NEAR(view.meanSurfaceDistance / (sum / pairs), 1.0, 0.005) << "400,000 draws";
}

TEST(InteriorView, HasTheKnownMeansOfABall) {
    const Segmentation s = segmented(makeSphere());
    const InteriorView view = interiorView(s);
    EXPECT_NEAR(view.meanSurfaceDistance * s.size, 4.0 / 3.0, 0.03);
    // Less than the 3/4 of solid matter, since tetrahedra reach from skin to skin and only their centroids
    // count.
    EXPECT_LT(view.meanRadius * s.size, 0.76);
    EXPECT_GT(view.meanRadius * s.size, 0.3);
    double thickness = 0.0;
    for (std::size_t t = 0; t < view.radii.size(); ++t) {
        thickness += view.volumes[t] / view.volume * view.radii[t] * s.size;
    }
    EXPECT_NEAR(thickness, 1.0, 0.05) << "as thick as its radius everywhere";
}

TEST(InteriorView, IsDeterministic) {
    const Segmentation s = segmented(makeDumbbell());
    const InteriorView a = interiorView(s);
    const InteriorView b = interiorView(s);
    EXPECT_EQ(a.sites, b.sites);
    EXPECT_EQ(a.surface, b.surface);
    EXPECT_EQ(a.meanSurfaceDistance, b.meanSurfaceDistance);
}

}  // namespace
}  // namespace shapedb
