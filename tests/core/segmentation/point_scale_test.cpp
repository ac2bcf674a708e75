#include "core/segmentation/point_scale.h"

#include <algorithm>
#include <vector>

#include <gtest/gtest.h>

#include "small_clouds.h"

namespace shapedb {
namespace {

double meanOfThreeNearest(const PointCloud& points, std::size_t of) {
    std::vector<double> distances;
    for (std::size_t i = 0; i < points.size(); ++i) {
        if (i != of) distances.push_back(distance(points[i], points[of]));
    }
    std::sort(distances.begin(), distances.end());
    return (distances[0] + distances[1] + distances[2]) / 3.0;
}

TEST(PointScale, IsTheMeanDistanceToTheThreeNearestByAllPairs) {
    for (const Triangulated& cloud : triangulatedClouds()) {
        const auto scales = pointScales(cloud.points, cloud.tetrahedra);
        ASSERT_EQ(scales.size(), cloud.points.size());
        for (std::size_t p = 0; p < scales.size(); ++p) {
            const double expected = meanOfThreeNearest(cloud.points, p);
            ASSERT_NEAR(scales[p], expected, 1e-14 * expected) << cloud.name << " point " << p;
        }
    }
}

TEST(PointScale, OfUnevenClusters) {
    // Neighbours of neighbours matter when a point's own star reaches across a gap.
    PointCloud points = {{0, 0, 0},       {0.01, 0, 0},    {0.02, 0.001, 0}, {0.03, 0, 0.001},
                         {0.9, 0.1, 0.2}, {0.1, 0.9, 0.3}, {0.2, 0.1, 0.9},  {-0.9, -0.8, -0.7}};
    const auto flat = triangulate(points);
    ASSERT_TRUE(flat);
    const auto scales = pointScales(points, *flat);
    for (std::size_t p = 0; p < points.size(); ++p) {
        EXPECT_DOUBLE_EQ(scales[p], meanOfThreeNearest(points, p)) << p;
    }
}

}  // namespace
}  // namespace shapedb
