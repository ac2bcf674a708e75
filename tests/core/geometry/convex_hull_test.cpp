// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/geometry/convex_hull.h"

#include <algorithm>
#include <vector>

#include <gtest/gtest.h>

#include "core/base/random.h"
#include "core/synthetic/degrade.h"
#include "core/synthetic/named_shapes.h"

namespace shapedb {
namespace {

TEST(CullHullInterior, KeepsEveryHullVertex) {
    for (const NamedShape& shape : namedShapes()) {
        for (const double noise : {0.0, 0.01}) {
            PointCloud points = sampleBoundary(shape.solid, 20000, 6).value();
            ASSERT_TRUE(addGaussianNoise(points, noise, 6));
            const PointCloud outer = cullHullInterior(points);
            EXPECT_TRUE(convexHullVertices(outer) == convexHullVertices(points)) << shape.name << noise;
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
