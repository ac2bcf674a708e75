// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/geometry/neighbours.h"

#include <algorithm>

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

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

TEST(NeighbourIndex, NearestAgreesWithSorting) {
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

PointCloud scattered(std::size_t count, std::uint64_t seed) {
    Random random(seed);
    PointCloud points;
    for (std::size_t i = 0; i < count; ++i) {
        points.push_back({random.normal(), random.uniform(), random.normal()});
    }
    return points;
}

void expectNearest(const PointCloud& points, const NeighbourIndex& index, const Point3& query) {
    std::vector<Neighbour> found;
    index.nearest(query, 3, found);
    const auto expected = sortedByDistance(points, query);
    ASSERT_EQ(found.size(), std::min<std::size_t>(3, points.size()));
    for (std::size_t k = 0; k < found.size(); ++k) {
        ASSERT_EQ(found[k].point, expected[k].point) << "of " << points.size();
    }
}

// The layout of the nodes depends on the number of points.
TEST(NeighbourIndex, WorksForAnyNumberOfPoints) {
    for (std::size_t count = 1; count <= 400; ++count) {
        const PointCloud points = scattered(count, count);
        const NeighbourIndex index(points);
        for (const std::size_t at : {std::size_t{0}, count / 2, count - 1}) {
            expectNearest(points, index, points[at]);
        }
    }
}

TEST(NeighbourIndex, IsTheSameForAnyNumberOfThreads) {
    const PointCloud points = scattered(30011, 8);
    std::vector<std::vector<std::uint32_t>> orders;
    for (const int threads : {1, 2, 5}) {
        tbb::task_arena arena(threads);
        const NeighbourIndex index = arena.execute([&] { return NeighbourIndex(points); });
        orders.push_back(index.order());
        for (const std::size_t at : {0U, 777U, 30010U}) expectNearest(points, index, points[at]);
    }
    EXPECT_EQ(orders[0], orders[1]);
    EXPECT_EQ(orders[0], orders[2]);
}

TEST(NeighbourIndex, WithinFindsExactlyThePointsInTheBall) {
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

TEST(NeighbourIndex, OrderHoldsEachPointOnce) {
    for (const PointCloud& points : clouds()) {
        std::vector<std::uint32_t> order = NeighbourIndex(points).order();
        std::sort(order.begin(), order.end());
        ASSERT_EQ(order.size(), points.size());
        for (std::uint32_t i = 0; i < order.size(); ++i) EXPECT_EQ(order[i], i);
    }
}

}  // namespace
}  // namespace shapedb
