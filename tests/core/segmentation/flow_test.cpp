// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/segmentation/flow.h"

#include <atomic>
#include <bitset>
#include <vector>

#include <gtest/gtest.h>

#include "core/geometry/tetrahedron.h"
#include "tests/core/segmentation/exact_balls.h"

namespace shapedb {
namespace {

// The definition, in rational numbers: circumcentre and opposite corner on different sides.
unsigned referenceMask(const Triangulated& cloud, std::size_t t) {
    const auto p = exactCorners(cloud, t);
    const ExactPoint centre = exactCentre(cloud, t);
    unsigned mask = 0;
    for (std::size_t i = 0; i < 4; ++i) {
        const auto& a = p[(i + 1) % 4];
        const auto& b = p[(i + 2) % 4];
        const auto& c = p[(i + 3) % 4];
        const auto sideOfCorner = CGAL::orientation(a, b, c, p[i]);
        if (CGAL::orientation(a, b, c, centre) == -sideOfCorner) mask |= 1u << i;
    }
    return mask;
}

std::vector<std::uint8_t> allMasks(const Triangulated& cloud) {
    const std::vector<std::uint8_t> all(cloud.tetrahedra.size(), 1);
    return flowMasks(cloud.points, cloud.tetrahedra, all).value();
}

TEST(FlowMasks, AgreeWithRationalArithmetic) {
    for (const Triangulated& cloud : triangulatedClouds()) {
        const auto masks = allMasks(cloud);
        ASSERT_EQ(masks.size(), cloud.tetrahedra.size());
        std::size_t wrong = 0;
        for (std::size_t t = 0; t < masks.size(); ++t) wrong += masks[t] != referenceMask(cloud, t);
        EXPECT_EQ(wrong, 0U) << cloud.name << " of " << masks.size();
    }
}

TEST(ExactFlowMask, AgreesWithRationalArithmetic) {
    for (const Triangulated& cloud : triangulatedClouds()) {
        for (std::size_t t = 0; t < cloud.tetrahedra.size(); ++t) {
            ASSERT_EQ(exactFlowMask(cornersOf(cloud, t)), referenceMask(cloud, t)) << cloud.name;
        }
    }
}

TEST(FlowMasks, LeaveThroughAtMostTwoFacets) {
    for (const Triangulated& cloud : triangulatedClouds()) {
        for (const std::uint8_t mask : allMasks(cloud))
            ASSERT_LE(std::bitset<8>(mask).count(), 2U) << cloud.name;
    }
}

TEST(FlowMasks, HaveNoCycles) {
    for (const Triangulated& cloud : triangulatedClouds()) {
        const auto masks = allMasks(cloud);
        const Tetrahedra& flat = cloud.tetrahedra;
        std::vector<int> incoming(flat.size(), 0);
        const auto forEachSuccessor = [&](std::size_t t, auto visit) {
            for (std::size_t i = 0; i < 4; ++i) {
                const std::uint32_t next = flat.neighbours[t][i];
                if (((masks[t] >> i) & 1) != 0 && next != kNoTetrahedron) visit(next);
            }
        };
        for (std::size_t t = 0; t < flat.size(); ++t) {
            forEachSuccessor(t, [&](std::uint32_t next) { ++incoming[next]; });
        }
        std::vector<std::size_t> ready;
        for (std::size_t t = 0; t < flat.size(); ++t) {
            if (incoming[t] == 0) ready.push_back(t);
        }
        std::size_t sorted = 0;
        while (!ready.empty()) {
            const std::size_t t = ready.back();
            ready.pop_back();
            ++sorted;
            forEachSuccessor(t, [&](std::uint32_t next) {
                if (--incoming[next] == 0) ready.push_back(next);
            });
        }
        EXPECT_EQ(sorted, flat.size()) << cloud.name;
    }
}

TEST(FlowMasks, NeverLeadToASmallerBall) {
    for (const Triangulated& cloud : triangulatedClouds()) {
        const auto masks = allMasks(cloud);
        std::vector<ExactNumber> squared;
        for (std::size_t t = 0; t < cloud.tetrahedra.size(); ++t) {
            squared.push_back(CGAL::squared_distance(exactCentre(cloud, t), exactCorners(cloud, t)[0]));
        }
        for (std::size_t t = 0; t < masks.size(); ++t) {
            for (std::size_t i = 0; i < 4; ++i) {
                const std::uint32_t next = cloud.tetrahedra.neighbours[t][i];
                if (((masks[t] >> i) & 1) == 0 || next == kNoTetrahedron) continue;
                ASSERT_GE(squared[next], squared[t]) << cloud.name;
            }
        }
    }
}

TEST(FlowMasks, AreEmptyWhereATetrahedronHoldsItsCircumcentre) {
    std::size_t maxima = 0;
    for (const Triangulated& cloud : triangulatedClouds()) {
        const auto masks = allMasks(cloud);
        for (std::size_t t = 0; t < masks.size(); ++t) {
            const auto p = exactCorners(cloud, t);
            const CGAL::Tetrahedron_3<ExactKernel> solid(p[0], p[1], p[2], p[3]);
            const bool holds = solid.bounded_side(exactCentre(cloud, t)) != CGAL::ON_UNBOUNDED_SIDE;
            ASSERT_EQ(masks[t] == 0, holds) << cloud.name;
            maxima += holds;
        }
    }
    EXPECT_GT(maxima, 100U);
}

TEST(FlowMasks, AreComputedOnlyWhereWanted) {
    const Triangulated& cloud = triangulatedClouds().front();
    const auto all = allMasks(cloud);
    std::vector<std::uint8_t> wanted(all.size());
    for (std::size_t t = 0; t < all.size(); ++t) wanted[t] = t % 3 == 0;
    const auto some = flowMasks(cloud.points, cloud.tetrahedra, wanted).value();
    for (std::size_t t = 0; t < all.size(); ++t) ASSERT_EQ(some[t], wanted[t] ? all[t] : 0);
}

TEST(FlowMasks, CanBeCancelled) {
    const Triangulated& cloud = triangulatedClouds().front();
    const std::vector<std::uint8_t> all(cloud.tetrahedra.size(), 1);
    const std::atomic<bool> cancel{true};
    RunContext context;
    context.cancel = &cancel;
    EXPECT_EQ(flowMasks(cloud.points, cloud.tetrahedra, all, context).error().code, ErrorCode::kCancelled);
}

}  // namespace
}  // namespace shapedb
