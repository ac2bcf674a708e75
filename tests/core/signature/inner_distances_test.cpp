// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/signature/inner_distances.h"

#include <algorithm>
#include <atomic>
#include <cmath>
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

TEST(InnerDistances, CellsCoverTheInterior) {
    const InteriorView view = viewOfCubes(horseshoe(14, 4, 3), 0.04);
    const auto inner = innerDistances(view);
    ASSERT_TRUE(inner);
    EXPECT_EQ(inner->volumes.size(), inner->centres.size());
    EXPECT_GT(inner->centres.size(), InnerDistances::kCells / 2);
    EXPECT_LT(inner->centres.size(), InnerDistances::kCells * 3);
    double volume = 0.0;
    for (const double v : inner->volumes) volume += v;
    EXPECT_NEAR(volume, view.volume, 0.03 * view.volume);
    // Points of matter lie where their tetrahedra do.
    ASSERT_FALSE(inner->matter.empty());
    for (const auto& [t, cell] : inner->matter) {
        ASSERT_NE(cell, InnerDistances::kNoCell);
        EXPECT_LT(distance(view.centroids[t], inner->centres[cell]), 0.15);
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
            // Walls are known to a voxel.
            if (straight > 0.3) {
                EXPECT_LT(inner->distance[s][c], 1.06 * straight);
            }
        }
    }
    // Two random points of a stick of length 1 are a third apart on average.
    EXPECT_GT(inner->mean, 0.33);
    EXPECT_LT(inner->mean, 0.35);
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
    EXPECT_GT(farthest, 1.7) << "out one arm and back the other";
    EXPECT_LT(farthest, 2.1);
    EXPECT_LT(straightThere, 0.35) << "the tips are near";
}

TEST(InnerDistances, DoNotCrossANarrowGap) {
    // The arms are closer to each other than two centres of cells.
    const InteriorView view = viewOfCubes(horseshoe(40, 8, 1), 1.0 / 40);
    const auto inner = innerDistances(view);
    ASSERT_TRUE(inner);
    double farthest = 0.0;
    for (const auto& row : inner->distance)
        farthest = std::max(farthest, *std::max_element(row.begin(), row.end()));
    EXPECT_GT(farthest, 1.5) << "round the end of the gap";
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
    const auto inner = innerDistances(view);
    ASSERT_TRUE(inner);
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
