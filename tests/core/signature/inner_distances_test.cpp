#include "core/signature/inner_distances.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <set>
#include <vector>

#include <gtest/gtest.h>

#include "core/delaunay/delaunay.h"
#include "tests/core/signature/cube_views.h"

namespace shapedb {
namespace {

using testing_support::cubeBlock;
using testing_support::horseshoe;
using testing_support::together;
using testing_support::viewOfCubes;

// All shortest paths (Floyd-Warshall), from the cells of the tetrahedra alone.
std::vector<std::vector<double>> plainDistances(const InteriorView& view, const InnerDistances& inner) {
    const std::size_t n = inner.centres.size();
    std::vector<std::vector<double>> d(n, std::vector<double>(n, InnerDistances::kUnreached));
    std::vector<Point3> centre(n);
    std::vector<double> volume(n, 0.0);
    for (std::size_t t = 0; t < view.vertices.size(); ++t) {
        const std::uint32_t c = inner.cellOfTetrahedron[t];
        centre[c] = centre[c] + view.volumes[t] * view.centroids[t];
        volume[c] += view.volumes[t];
    }
    for (std::size_t c = 0; c < n; ++c) centre[c] = (1.0 / volume[c]) * centre[c];
    for (std::size_t c = 0; c < n; ++c) d[c][c] = 0.0;
    for (std::size_t t = 0; t < view.vertices.size(); ++t) {
        for (const std::uint32_t next : view.neighbours[t]) {
            if (next == kNoTetrahedron) continue;
            const std::uint32_t a = inner.cellOfTetrahedron[t];
            const std::uint32_t b = inner.cellOfTetrahedron[next];
            if (a != b) d[a][b] = d[b][a] = distance(centre[a], centre[b]);
        }
    }
    for (std::size_t k = 0; k < n; ++k) {
        for (std::size_t i = 0; i < n; ++i) {
            for (std::size_t j = 0; j < n; ++j) d[i][j] = std::min(d[i][j], d[i][k] + d[k][j]);
        }
    }
    return d;
}

void expectShortest(const InteriorView& view, const InnerDistances& inner) {
    ASSERT_LE(inner.centres.size(), 700U) << "the plain reference is cubic";
    const auto plain = plainDistances(view, inner);
    double sum = 0.0;
    double weight = 0.0;
    for (std::size_t s = 0; s < inner.sources.size(); ++s) {
        for (std::size_t c = 0; c < inner.centres.size(); ++c) {
            const double expected = plain[inner.sources[s]][c];
            if (expected >= InnerDistances::kUnreached) {
                EXPECT_EQ(inner.distance[s][c], InnerDistances::kUnreached);
                continue;
            }
            EXPECT_NEAR(inner.distance[s][c], expected, 1e-12);
            sum += expected * inner.volumes[c];
            weight += inner.volumes[c];
        }
    }
    EXPECT_NEAR(inner.mean, sum / weight, 1e-9);
}

TEST(InnerDistances, AreLengthsOfShortestPaths) {
    for (const auto& cubes : {horseshoe(6, 1, 2), cubeBlock({0, 0, 0}, {4, 3, 2}),
                              together(cubeBlock({0, 0, 0}, {2, 2, 2}), cubeBlock({5, 0, 0}, {8, 2, 2}))}) {
        const InteriorView view = viewOfCubes(cubes, 0.1);
        const auto inner = innerDistances(view);
        ASSERT_TRUE(inner);
        expectShortest(view, *inner);
    }
}

TEST(InnerDistances, CellsAreConnectedLumpsThatCoverTheInterior) {
    const InteriorView view = viewOfCubes(horseshoe(14, 4, 3), 0.04);
    const auto inner = innerDistances(view);
    ASSERT_TRUE(inner);
    ASSERT_EQ(inner->cellOfTetrahedron.size(), view.vertices.size());
    EXPECT_EQ(inner->volumes.size(), inner->centres.size());
    EXPECT_GT(inner->centres.size(), InnerDistances::kCells / 3);
    EXPECT_LT(inner->centres.size(), InnerDistances::kCells * 6);
    double volume = 0.0;
    for (const double v : inner->volumes) volume += v;
    EXPECT_NEAR(volume, view.volume, 1e-9 * view.volume);

    std::vector<std::vector<std::uint32_t>> members(inner->centres.size());
    for (std::uint32_t t = 0; t < view.vertices.size(); ++t) {
        members[inner->cellOfTetrahedron[t]].push_back(t);
    }
    const double side = std::cbrt(view.volume / static_cast<double>(InnerDistances::kCells));
    for (const auto& cell : members) {
        ASSERT_FALSE(cell.empty());
        std::set<std::uint32_t> reached = {cell.front()};
        std::vector<std::uint32_t> open = {cell.front()};
        while (!open.empty()) {
            const std::uint32_t t = open.back();
            open.pop_back();
            for (const std::uint32_t next : view.neighbours[t]) {
                if (next == kNoTetrahedron) continue;
                if (inner->cellOfTetrahedron[next] != inner->cellOfTetrahedron[t]) continue;
                if (reached.insert(next).second) open.push_back(next);
            }
        }
        EXPECT_EQ(reached.size(), cell.size()) << "in one piece";
        for (const std::uint32_t t : cell) {
            EXPECT_LT(distance(view.centroids[t], view.centroids[cell.front()]), 1.8 * side);
        }
    }
    ASSERT_EQ(inner->sources.size(), InnerDistances::kSources);
    ASSERT_EQ(inner->distance.size(), InnerDistances::kSources);
}

TEST(InnerDistances, AreStraightAlongARod) {
    const InteriorView view = viewOfCubes(cubeBlock({0, 0, 0}, {60, 4, 4}), 1.0 / 60);
    const auto inner = innerDistances(view);
    ASSERT_TRUE(inner);
    for (std::size_t s = 0; s < inner->sources.size(); ++s) {
        for (std::size_t c = 0; c < inner->centres.size(); ++c) {
            const double straight = distance(inner->centres[inner->sources[s]], inner->centres[c]);
            EXPECT_GE(inner->distance[s][c], straight - 1e-12);
            // Paths zigzag from cell to cell.
            if (straight > 0.3) {
                EXPECT_LT(inner->distance[s][c], 1.3 * straight);
            }
        }
    }
    // Two random points of a stick of length 1 are a third apart on average.
    EXPECT_GT(inner->mean, 0.33);
    EXPECT_LT(inner->mean, 0.43);
}

TEST(InnerDistances, GoRoundAHorseshoe) {
    const InteriorView view = viewOfCubes(horseshoe(30, 3, 3), 1.0 / 30);
    const auto inner = innerDistances(view);
    ASSERT_TRUE(inner);
    double farthest = 0.0;
    double straightThere = 0.0;
    for (std::size_t s = 0; s < inner->sources.size(); ++s) {
        for (std::size_t c = 0; c < inner->centres.size(); ++c) {
            if (inner->distance[s][c] <= farthest) continue;
            farthest = inner->distance[s][c];
            straightThere = distance(inner->centres[inner->sources[s]], inner->centres[c]);
        }
    }
    EXPECT_GT(farthest, 1.8) << "out one arm and back the other";
    EXPECT_LT(farthest, 2.7);
    EXPECT_LT(straightThere, 0.35) << "the tips are near";
}

TEST(InnerDistances, DoNotReachOtherPieces) {
    const auto left = cubeBlock({0, 0, 0}, {3, 3, 3});
    const InteriorView view = viewOfCubes(together(left, cubeBlock({5, 0, 0}, {8, 3, 3})), 0.1);
    const auto inner = innerDistances(view);
    ASSERT_TRUE(inner);
    std::size_t unreached = 0;
    std::size_t all = 0;
    for (std::size_t s = 0; s < inner->sources.size(); ++s) {
        for (std::size_t c = 0; c < inner->centres.size(); ++c) {
            const bool far = inner->distance[s][c] == InnerDistances::kUnreached;
            if (!far) {
                EXPECT_LT(inner->distance[s][c], 1.0);
            }
            unreached += far ? 1 : 0;
            ++all;
        }
    }
    EXPECT_NEAR(static_cast<double>(unreached) / static_cast<double>(all), 0.5, 0.02) << "the other piece";
    EXPECT_GT(inner->mean, 0.0);
    EXPECT_LT(inner->mean, 0.4) << "of those reached only";
}

TEST(InnerDistances, HaveAUnitForASingleTetrahedron) {
    InteriorView view = viewOfCubes(cubeBlock({0, 0, 0}, {1, 1, 1}), 0.5);
    const auto keepOne = [](auto& all) { all.resize(1); };
    keepOne(view.vertices);
    keepOne(view.volumes);
    keepOne(view.centroids);
    keepOne(view.radii);
    view.neighbours = {{kNoTetrahedron, kNoTetrahedron, kNoTetrahedron, kNoTetrahedron}};
    view.volume = view.volumes.front();
    std::fill(view.sampled.begin(), view.sampled.end(), 0U);
    const auto inner = innerDistances(view);
    ASSERT_TRUE(inner);
    EXPECT_EQ(inner->centres.size(), 1U);
    EXPECT_GT(inner->mean, 0.0);
}

TEST(InnerDistances, CanBeCancelled) {
    const InteriorView view = viewOfCubes(cubeBlock({0, 0, 0}, {3, 3, 3}), 0.2);
    const std::atomic<bool> cancel{true};
    RunContext context;
    context.cancel = &cancel;
    EXPECT_EQ(innerDistances(view, context).error().code, ErrorCode::kCancelled);
    RunContext late;
    late.deadline = RunContext::Clock::now() - std::chrono::seconds(1);
    EXPECT_EQ(innerDistances(view, late).error().code, ErrorCode::kDeadlineExceeded);
}

}  // namespace
}  // namespace shapedb
