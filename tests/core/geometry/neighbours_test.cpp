#include "core/geometry/neighbours.h"

#include <algorithm>

#include <gtest/gtest.h>

#include "core/base/random.h"

namespace shapedb {
namespace {

std::vector<PointCloud> clouds() {
    Random random(7);
    PointCloud scattered;
    for (int i = 0; i < 700; ++i) scattered.push_back({random.normal(), random.uniform(), random.normal()});
    PointCloud grid;  // many equal distances
    for (int x = 0; x < 6; ++x) {
        for (int y = 0; y < 6; ++y) {
            for (int z = 0; z < 6; ++z) grid.push_back({0.5 * x, 0.5 * y, 0.5 * z});
        }
    }
    const PointCloud same(40, Point3{1.0, 2.0, 3.0});
    return {scattered, grid, same, {Point3{1.0, 1.0, 1.0}}, {}};
}

std::vector<Neighbour> sortedByDistance(const PointCloud& points, const Point3& query) {
    std::vector<Neighbour> all;
    for (std::uint32_t i = 0; i < points.size(); ++i) all.push_back({squaredDistance(points[i], query), i});
    std::sort(all.begin(), all.end());
    return all;
}

TEST(NeighbourIndex, NearestAreThoseOfASort) {
    Random random(3);
    for (const PointCloud& points : clouds()) {
        const NeighbourIndex index(points);
        std::vector<Neighbour> found;
        for (int q = 0; q < 60; ++q) {
            const Point3 query = q % 2 == 0 && !points.empty()
                                     ? points[random.below(points.size())]
                                     : Point3{random.normal(), random.normal(), random.normal()};
            for (const std::size_t count :
                 {std::size_t{0}, std::size_t{1}, std::size_t{9}, std::size_t{1000}}) {
                index.nearest(query, count, found);
                auto expected = sortedByDistance(points, query);
                expected.resize(std::min(count, expected.size()));
                ASSERT_EQ(found.size(), expected.size());
                for (std::size_t k = 0; k < found.size(); ++k) {
                    EXPECT_EQ(found[k].point, expected[k].point);
                    EXPECT_EQ(found[k].squaredDistance, expected[k].squaredDistance);
                }
            }
        }
    }
}

TEST(NeighbourIndex, WithinIsTheWholeBallAndNothingElse) {
    Random random(4);
    for (const PointCloud& points : clouds()) {
        const NeighbourIndex index(points);
        std::vector<Neighbour> found;
        for (int q = 0; q < 60; ++q) {
            const Point3 query{random.normal(), random.normal(), random.normal()};
            const double radius = 0.5 * static_cast<double>(q % 5);  // on the grid some lie exactly at it
            index.within(query, radius, found);
            std::sort(found.begin(), found.end());
            auto expected = sortedByDistance(points, query);
            expected.erase(
                std::remove_if(expected.begin(), expected.end(),
                               [&](const Neighbour& n) { return n.squaredDistance > radius * radius; }),
                expected.end());
            ASSERT_EQ(found.size(), expected.size());
            for (std::size_t k = 0; k < found.size(); ++k) EXPECT_EQ(found[k].point, expected[k].point);
        }
    }
}

TEST(NeighbourIndex, TheOrderHoldsEachPointOnce) {
    for (const PointCloud& points : clouds()) {
        std::vector<std::uint32_t> order = NeighbourIndex(points).order();
        std::sort(order.begin(), order.end());
        ASSERT_EQ(order.size(), points.size());
        for (std::uint32_t i = 0; i < order.size(); ++i) EXPECT_EQ(order[i], i);
    }
}

}  // namespace
}  // namespace shapedb
