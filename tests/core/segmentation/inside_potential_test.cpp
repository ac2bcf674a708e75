// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/segmentation/inside_potential.h"

#include <atomic>
#include <cmath>

#include <gtest/gtest.h>

#include "core/base/random.h"
#include "tests/core/segmentation/small_clouds.h"

namespace shapedb {
namespace {

PointCloud sphere(double radius, std::size_t count, std::uint64_t seed) {
    Random random(seed);
    PointCloud points;
    while (points.size() < count) {
        const Point3 d{random.normal(), random.normal(), random.normal()};
        points.push_back((radius / length(d)) * d);
    }
    return points;
}

// The share of the volume whose potential has the right sign.
double shareRight(const PointCloud& points, bool (*isInside)(double radius)) {
    const auto tetrahedra = triangulate(points);
    const auto potential = insidePotential(points, *tetrahedra, findPoles(points, *tetrahedra));
    double right = 0.0;
    double all = 0.0;
    for (std::size_t t = 0; t < tetrahedra->size(); ++t) {
        const auto& v = tetrahedra->vertices[t];
        const Point3 centroid = 0.25 * (points[v[0]] + points[v[1]] + points[v[2]] + points[v[3]]);
        const Point3& o = points[v[0]];
        const double volume = dot(points[v[1]] - o, cross(points[v[2]] - o, points[v[3]] - o)) / 6.0;
        all += volume;
        if (((*potential)[t] < 0.0) == isInside(length(centroid))) right += volume;
    }
    return right / all;
}

TEST(FindPoles, AreTheLargestBallsOnEitherSide) {
    for (const Triangulated& cloud : triangulatedClouds()) {
        const Tetrahedra& tetrahedra = cloud.tetrahedra;
        const auto poles = findPoles(cloud.points, tetrahedra);
        ASSERT_EQ(poles.size(), cloud.points.size());
        for (std::uint32_t p = 0; p < cloud.points.size(); ++p) {
            bool hull = false;
            double largest = 0.0;
            for (std::size_t t = 0; t < tetrahedra.size(); ++t) {
                for (std::size_t i = 0; i < 4; ++i) {
                    if (tetrahedra.vertices[t][i] != p) continue;
                    largest = std::max(largest, tetrahedra.circumradii[t]);
                    for (std::size_t k = 1; k < 4; ++k) {
                        hull = hull || tetrahedra.neighbours[t][(i + k) % 4] == kNoTetrahedron;
                    }
                }
            }
            EXPECT_EQ(poles[p].first == kNoTetrahedron, hull) << cloud.name << " " << p;
            if (!hull) {
                EXPECT_EQ(tetrahedra.circumradii[poles[p].first], largest) << cloud.name << " " << p;
            }
            if (poles[p].second != kNoTetrahedron) {
                EXPECT_LT(poles[p].cosine, 0.0) << cloud.name << " " << p;
            }
        }
    }
}

TEST(InsidePotential, IsNegativeInASphere) {
    const auto inside = [](double) { return true; };
    EXPECT_GT(shareRight(sphere(1.0, 2000, 1), inside), 0.99);
}

TEST(InsidePotential, FlipsItsSignTwiceForACavity) {
    PointCloud points = sphere(1.0, 3000, 1);
    for (const Point3& p : sphere(0.6, 1100, 2)) points.push_back(p);
    const auto inside = [](double radius) { return radius > 0.6; };
    EXPECT_GT(shareRight(points, inside), 0.97);
}

TEST(InsidePotential, HoldsWhereAWalkWouldLeakThroughAHole) {
    PointCloud points;
    for (const Point3& p : sphere(1.0, 4000, 3)) {
        if (p.z < 0.8) points.push_back(p);
    }
    const auto inside = [](double) { return true; };
    EXPECT_GT(shareRight(points, inside), 0.97);
}

TEST(InsidePotential, StaysBetweenMinusOneAndOne) {
    for (const Triangulated& cloud : triangulatedClouds()) {
        const auto potential =
            insidePotential(cloud.points, cloud.tetrahedra, findPoles(cloud.points, cloud.tetrahedra));
        ASSERT_TRUE(potential);
        ASSERT_EQ(potential->size(), cloud.tetrahedra.size());
        for (const double value : *potential) EXPECT_LE(std::abs(value), 1.0 + 1e-3) << cloud.name;
    }
}

TEST(InsidePotential, CanBeCancelled) {
    const PointCloud points = sphere(1.0, 500, 4);
    const auto tetrahedra = triangulate(points);
    const std::atomic<bool> cancel{true};
    RunContext context;
    context.cancel = &cancel;
    const auto potential = insidePotential(points, *tetrahedra, findPoles(points, *tetrahedra), context);
    ASSERT_FALSE(potential);
    EXPECT_EQ(potential.error().code, ErrorCode::kCancelled);
}

}  // namespace
}  // namespace shapedb
