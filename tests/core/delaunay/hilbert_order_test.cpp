// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/delaunay/hilbert_order.h"

#include <algorithm>
#include <vector>

#include <gtest/gtest.h>

#include "core/base/random.h"
#include "core/delaunay/delaunay.h"

namespace shapedb {
namespace {

constexpr double kStep = 0.0625;

PointCloud grid(int side) {
    PointCloud points;
    for (int i = 0; i < side; ++i) {
        for (int j = 0; j < side; ++j) {
            for (int k = 0; k < side; ++k) points.push_back({i * kStep, j * kStep, k * kStep});
        }
    }
    return points;
}

TEST(HilbertOrder, IsAPermutationThatStepsToNeighbours) {
    const PointCloud points = grid(16);
    auto order = hilbertOrder(points);
    double longest = 0.0;
    double sum = 0.0;
    for (std::size_t i = 1; i < order.size(); ++i) {
        const double step = distance(points[order[i - 1]], points[order[i]]);
        longest = std::max(longest, step);
        sum += step;
    }
    // A Hilbert curve visits a grid of 2^k along each axis from neighbour to neighbour.
    EXPECT_LE(longest, 2 * kStep + 1e-12);
    EXPECT_LT(sum, 1.1 * kStep * static_cast<double>(points.size()));
    std::sort(order.begin(), order.end());
    for (std::uint32_t i = 0; i < order.size(); ++i) ASSERT_EQ(order[i], i);
}

TEST(HilbertOrder, KeepsTheOrderOfEqualPoints) {
    EXPECT_TRUE(hilbertOrder({}).empty());
    EXPECT_EQ(hilbertOrder({{1, 2, 3}}).size(), 1U);
    EXPECT_EQ(hilbertOrder({{1, 2, 3}, {1, 2, 3}, {1, 2, 3}}), (std::vector<std::uint32_t>{0, 1, 2}));
}

TEST(HilbertSortedCloud, HoldsThePointsInHilbertOrder) {
    const PointCloud points = grid(5);
    HilbertSortedCloud sorted(points);
    const std::vector<std::uint32_t> order = hilbertOrder(points);
    EXPECT_EQ(sorted.order(), order);
    ASSERT_EQ(sorted.points().size(), points.size());
    for (std::size_t i = 0; i < order.size(); ++i) {
        EXPECT_EQ(distance(sorted.points()[i], points[order[i]]), 0.0) << i;
    }
    const PointCloud before = sorted.points();
    EXPECT_EQ(std::move(sorted).takePoints().size(), before.size());
    // Sorting again changes nothing: who has a sorted cloud need not do it.
    const std::vector<std::uint32_t> again = hilbertOrder(before);
    EXPECT_TRUE(std::is_sorted(again.begin(), again.end()));
}

TEST(HilbertSortedCloud, IsTriangulatedLikeTheUnsortedCloud) {
    Random random(2);
    PointCloud points;
    for (int i = 0; i < 500; ++i) points.push_back({random.uniform(), random.uniform(), random.uniform()});
    const HilbertSortedCloud sorted(points);
    const Tetrahedra direct = triangulate(sorted).value();
    Tetrahedra renumbered = triangulate(points).value();
    std::vector<std::uint32_t> rank(points.size());
    for (std::uint32_t i = 0; i < points.size(); ++i) rank[sorted.order()[i]] = i;
    for (auto& corners : renumbered.vertices) {
        for (std::uint32_t& v : corners) v = rank[v];
    }
    EXPECT_TRUE(direct.vertices == renumbered.vertices);
    EXPECT_TRUE(direct.neighbours == renumbered.neighbours);
    EXPECT_TRUE(direct.circumradii == renumbered.circumradii);
}

}  // namespace
}  // namespace shapedb
