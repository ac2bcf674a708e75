// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/segmentation/bottleneck_angle.h"

#include <atomic>
#include <cmath>

#include <gtest/gtest.h>

#include "core/base/math.h"
#include "core/geometry/neighbours.h"
#include "core/segmentation/interior.h"
#include "tests/core/segmentation/small_clouds.h"

namespace shapedb {
namespace {

// The tetrahedra that a plain walk reaches through facets (also those of the hull) below `angle`.
std::vector<std::uint8_t> reached(const Triangulated& cloud, const std::vector<std::uint8_t>& big,
                                  double angle) {
    const Tetrahedra& tetrahedra = cloud.tetrahedra;
    std::vector<std::uint8_t> in(big.size(), 0);
    for (bool changed = true; changed;) {
        changed = false;
        for (std::size_t t = 0; t < big.size(); ++t) {
            for (std::size_t f = 0; big[t] && !in[t] && f < 4; ++f) {
                const std::uint32_t next = tetrahedra.neighbours[t][f];
                if (next != kNoTetrahedron && !in[next]) continue;
                if (std::acos(facetCosine(cloud.points, tetrahedra, t, f)) >= angle) continue;
                in[t] = 1;
                changed = true;
            }
        }
    }
    return in;
}

TEST(BottleneckAngles, AreTheAnglesAtWhichAWalkGetsThrough) {
    for (const Triangulated& cloud : triangulatedClouds()) {
        const auto big = bigBalls(cloud.tetrahedra, localSpacings(cloud.points).value(), 0.5);
        const auto bottlenecks = bottleneckAngles(cloud.points, cloud.tetrahedra, big);
        ASSERT_TRUE(bottlenecks);
        for (const double degrees : {3.0, 11.0, 22.0, 37.0, 61.0, 95.0, 140.0}) {
            const auto walk = reached(cloud, big, toRadians(degrees));
            for (std::size_t t = 0; t < big.size(); ++t) {
                const double bottleneck = (*bottlenecks)[t];
                if (std::abs(bottleneck - toRadians(degrees)) < 1e-9) continue;  // rounding decides
                ASSERT_EQ(walk[t] != 0, bottleneck < toRadians(degrees))
                    << cloud.name << " " << t << " " << degrees;
            }
        }
    }
}

TEST(FacetCosine, IsTheSameFromBothSides) {
    for (const Triangulated& cloud : triangulatedClouds()) {
        const Tetrahedra& tetrahedra = cloud.tetrahedra;
        for (std::uint32_t t = 0; t < tetrahedra.size(); ++t) {
            for (std::size_t f = 0; f < 4; ++f) {
                const double cosine = facetCosine(cloud.points, tetrahedra, t, f);
                ASSERT_GE(cosine, -1.0);
                ASSERT_LE(cosine, 1.0);
                const std::uint32_t next = tetrahedra.neighbours[t][f];
                if (next == kNoTetrahedron) continue;
                for (std::size_t g = 0; g < 4; ++g) {
                    if (tetrahedra.neighbours[next][g] != t) continue;
                    const Point3& shared = cloud.points[tetrahedra.vertices[t][(f + 1) % 4]];
                    const double angle = intersectionAngle(tetrahedra.circumcentres[t],
                                                           tetrahedra.circumcentres[next], shared);
                    ASSERT_NEAR(std::cos(angle), cosine, 1e-6) << cloud.name;
                    ASSERT_NEAR(facetCosine(cloud.points, tetrahedra, next, g), cosine, 1e-6) << cloud.name;
                }
            }
        }
    }
}

TEST(BottleneckAngles, AreInfiniteForBallsThatAreNotBig) {
    const Triangulated& cloud = triangulatedClouds().front();
    const auto bottlenecks = bottleneckAngles(cloud.points, cloud.tetrahedra,
                                              std::vector<std::uint8_t>(cloud.tetrahedra.size(), 0));
    ASSERT_TRUE(bottlenecks);
    for (const double bottleneck : *bottlenecks) EXPECT_TRUE(std::isinf(bottleneck));
}

}  // namespace
}  // namespace shapedb
