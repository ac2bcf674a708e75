// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/signature/voxels.h"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

#include "core/base/random.h"
#include "core/geometry/motion.h"
#include "tests/core/signature/cube_views.h"

namespace shapedb {
namespace {

using testing_support::barycentric;
using testing_support::cubeBlock;
using testing_support::horseshoe;
using testing_support::randomPointIn;
using testing_support::viewOfCubes;

// Only what Voxels reads; the tetrahedra may overlap.
InteriorView scattered(std::size_t count, std::uint64_t seed) {
    Random random(seed);
    InteriorView view;
    for (std::uint32_t t = 0; t < count; ++t) {
        const Point3 at{random.uniform(-0.4, 0.4), random.uniform(-0.2, 0.2), random.uniform(-0.1, 0.1)};
        for (int v = 0; v < 4; ++v) {
            view.sites.push_back(at + 0.1 * Point3{random.normal(), random.normal(), random.normal()});
        }
        view.vertices.push_back({4 * t, 4 * t + 1, 4 * t + 2, 4 * t + 3});
    }
    return view;
}

struct Grid {
    Point3 low{1e9, 1e9, 1e9};
    Point3 high{-1e9, -1e9, -1e9};
    double side = 0.0;

    explicit Grid(const InteriorView& view) {
        for (const Point3& p : view.sites) {
            low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
            high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
        }
        side = std::max({high.x - low.x, high.y - low.y, high.z - low.z}) /
               static_cast<double>(Voxels::kLongestSide);
    }
    Point3 centreAround(const Point3& p) const {
        const auto middle = [this](double x, double from) {
            return from + (std::floor((x - from) / side) + 0.5) * side;
        };
        return {middle(p.x, low.x), middle(p.y, low.y), middle(p.z, low.z)};
    }
};

// Largest, over all tetrahedra, of the smallest barycentric coordinate of p: 0 on a border.
double depth(const InteriorView& view, const Point3& p) {
    double best = -1e9;
    for (std::size_t t = 0; t < view.vertices.size(); ++t) {
        const auto b = barycentric(view, t, p);
        best = std::max(best, *std::min_element(b.begin(), b.end()));
    }
    return best;
}

TEST(Voxels, AreInsideWhereTheirCentresAre) {
    for (const std::uint64_t seed : {1U, 2U, 3U}) {
        const InteriorView view = scattered(25, seed);
        const Voxels voxels(view);
        const Grid grid(view);
        Random random(seed);
        int inside = 0;
        int asked = 0;
        for (int n = 0; n < 4000; ++n) {
            const Point3 p{random.uniform(grid.low.x, grid.high.x), random.uniform(grid.low.y, grid.high.y),
                           random.uniform(grid.low.z, grid.high.z)};
            const double deep = depth(view, grid.centreAround(p));
            if (std::abs(deep) < 1e-6) continue;
            ASSERT_EQ(voxels.inside(p), deep > 0.0) << seed << " " << n;
            inside += deep > 0.0 ? 1 : 0;
            ++asked;
        }
        EXPECT_GT(inside, asked / 50) << "both kinds";
        EXPECT_LT(inside, asked * 9 / 10);
        EXPECT_FALSE(voxels.inside(grid.high + Point3{1, 1, 1}));
        EXPECT_FALSE(voxels.inside(grid.low - Point3{1e6, 0, 0}));
    }
}

TEST(Voxels, AreNotInsideFlatTetrahedra) {
    InteriorView view = scattered(2, 9);
    view.sites[7] = view.sites[6];
    const Voxels voxels(view);
    Random random(1);
    for (int n = 0; n < 500; ++n) {
        const Point3 p = view.sites[4] + random.uniform() * (view.sites[5] - view.sites[4]);
        const double deep = [&] {
            InteriorView first = view;
            first.vertices.resize(1);
            return depth(first, Grid(view).centreAround(p));
        }();
        if (std::abs(deep) > 1e-6) {
            EXPECT_EQ(voxels.inside(p), deep > 0.0);
        }
    }
}

TEST(Voxels, MeasureTheFractionOfALineInside) {
    const InteriorView view = viewOfCubes(horseshoe(12, 3, 4), 0.05);
    const Voxels voxels(view);
    Random random(4);
    double worst = 0.0;
    double sum = 0.0;
    constexpr int kLines = 150;
    for (int n = 0; n < kLines; ++n) {
        const Point3 a = randomPointIn(view, random.below(view.vertices.size()), random);
        const Point3 b = randomPointIn(view, random.below(view.vertices.size()), random);
        int found = 0;
        constexpr int kSteps = 50;
        for (int s = 0; s < kSteps; ++s)
            found += depth(view, a + ((s + 0.5) / kSteps) * (b - a)) > 0.0 ? 1 : 0;
        const double error = std::abs(voxels.shareInside(a, b) - found / static_cast<double>(kSteps));
        worst = std::max(worst, error);
        sum += error;
    }
    EXPECT_LT(sum / kLines, 0.03);
    EXPECT_LT(worst, 0.4) << "a line along a face";
}

TEST(Voxels, HoldWholeLinesOfAConvexSolid) {
    const InteriorView view = viewOfCubes(cubeBlock({0, 0, 0}, {6, 5, 4}), 0.1);
    const Voxels voxels(view);
    Random random(5);
    double sum = 0.0;
    for (int n = 0; n < 500; ++n) {
        const Point3 a = randomPointIn(view, random.below(view.vertices.size()), random);
        const Point3 b = randomPointIn(view, random.below(view.vertices.size()), random);
        sum += voxels.shareInside(a, b);
        EXPECT_EQ(voxels.shareInside(a, b), voxels.shareInside(a, b));
    }
    EXPECT_GT(sum / 500, 0.98);
    // Half of it inside, half beyond the solid.
    const Point3 far = 40.0 * view.sites.front();
    EXPECT_LT(voxels.shareInside(20.0 * view.sites.front(), far), 0.01);
    EXPECT_NEAR(voxels.shareInside(Point3{}, 2.0 * view.sites.front()), 0.5, 0.03);
    EXPECT_EQ(voxels.shareInside(Point3{}, Point3{}), 1.0);
}

}  // namespace
}  // namespace shapedb
