#include "core/geometry/cull_hull_interior.h"

#include <algorithm>
#include <iterator>
#include <vector>

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/convex_hull_3.h>
#include <gtest/gtest.h>

#include "core/base/random.h"
#include "core/synthetic/named_shapes.h"
#include "core/synthetic/noise.h"

namespace shapedb {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;

PointCloud hullVertices(const PointCloud& points) {
    std::vector<Kernel::Point_3> copies;
    for (const Point3& p : points) copies.emplace_back(p.x, p.y, p.z);
    std::vector<Kernel::Point_3> extreme;
    CGAL::extreme_points_3(copies, std::back_inserter(extreme));
    PointCloud vertices;
    for (const auto& p : extreme) vertices.push_back({p.x(), p.y(), p.z()});
    std::sort(vertices.begin(), vertices.end(), lexicographicLess);
    return vertices;
}

TEST(CullHullInterior, KeepsEveryHullVertex) {
    for (const NamedShape& shape : namedShapes()) {
        for (const double noise : {0.0, 0.01}) {
            PointCloud points = sampleBoundary(shape.solid, 20000, 6).value();
            ASSERT_TRUE(addGaussianNoise(points, noise, 6));
            const PointCloud outer = cullHullInterior(points);
            EXPECT_TRUE(hullVertices(outer) == hullVertices(points)) << shape.name << noise;
        }
    }
}

TEST(CullHullInterior, DropsMostPointsAndKeepsTheOrder) {
    for (const double thickness : {1.0, 1e-3}) {
        Random random(3);
        PointCloud points;
        for (int i = 0; i < 50000; ++i) {
            points.push_back({random.normal(), random.normal(), thickness * random.normal()});
        }
        const PointCloud outer = cullHullInterior(points);
        EXPECT_LT(outer.size(), points.size() / 3) << thickness;
        auto at = points.begin();
        for (const Point3& p : outer) at = std::find(at, points.end(), p);
        EXPECT_NE(at, points.end());
    }
}

TEST(CullHullInterior, KeepsFlatAndSmallCloudsWhole) {
    PointCloud plane;
    for (int i = 0; i < 5000; ++i) plane.push_back({(i % 70) * 0.01, (i / 70) * 0.01, 0.5});
    EXPECT_EQ(cullHullInterior(plane).size(), plane.size());
    EXPECT_EQ(cullHullInterior(PointCloud(5000, Point3{1, 2, 3})).size(), 5000U);
    EXPECT_TRUE(cullHullInterior({}).empty());
}

}  // namespace
}  // namespace shapedb
