// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/fit/nearest_grid.h"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

#include "core/base/random.h"
#include "core/fit/fit_loops.h"
#include "core/fit/fit_points.h"
#include "core/synthetic/families.h"

namespace shapedb {
namespace {

FitPoints someShape(const char* family) {
    const auto member = makeMember(family, 0, 1);
    return FitPoints(*makeSurfacePoints(*scanOf(*member, {})));
}

std::vector<float> randomColumn(Random& random, std::size_t count, double reach) {
    std::vector<float> column;
    for (std::size_t i = 0; i < count; ++i)
        column.push_back(static_cast<float>(random.uniform(-reach, reach)));
    return column;
}

std::size_t cellOf(const NearestGrid& grid, float x, float y, float z) {
    const float places[3] = {x, y, z};
    std::size_t cell[3];
    for (std::size_t k = 0; k < 3; ++k) {
        const float at = grid.scale() * places[k] + grid.offset()[k];
        const auto last = static_cast<float>(grid.cells()[k] - 1);
        cell[k] = static_cast<std::size_t>(std::fmin(std::fmax(at, 0.0f), last));
    }
    return (cell[2] * static_cast<std::size_t>(grid.cells()[1]) + cell[1]) *
               static_cast<std::size_t>(grid.cells()[0]) +
           cell[0];
}

TEST(NearestGrid, KnowsAPointNearlyNearestToEveryCell) {
    for (const char* family : {"animal", "table", "spoon"}) {
        const FitPoints shape = someShape(family);
        const NearestGrid& grid = shape.grid;
        const auto& n = grid.cells();
        std::size_t at = 0;
        double excess = 0.0;  // in cells
        double worst = 0.0;
        for (std::int32_t z = 0; z < n[2]; ++z) {
            for (std::int32_t y = 0; y < n[1]; ++y) {
                for (std::int32_t x = 0; x < n[0]; ++x, ++at) {
                    const auto middle = [&](std::int32_t i, std::size_t axis) {
                        return (static_cast<double>(i) + 0.5 - static_cast<double>(grid.offset()[axis])) /
                               static_cast<double>(grid.scale());
                    };
                    const Point3 p{middle(x, 0), middle(y, 1), middle(z, 2)};
                    const auto gap = [&](std::size_t i) {
                        return distance(p, {static_cast<double>(shape.columns.x[i]),
                                            static_cast<double>(shape.columns.y[i]),
                                            static_cast<double>(shape.columns.z[i])});
                    };
                    double nearest = INFINITY;
                    for (std::size_t i = 0; i < shape.size(); ++i) nearest = std::min(nearest, gap(i));
                    const double found = gap(grid.nearest()[at]);
                    excess += static_cast<double>(grid.scale()) * (found - nearest);
                    worst = std::max(worst, static_cast<double>(grid.scale()) * (found - nearest));
                }
            }
        }
        EXPECT_LT(worst, 1.0) << family;
        EXPECT_LT(excess, 0.1 * static_cast<double>(grid.size())) << family;
    }
}

// The loops in lanes against plain loops over one point at a time. Each lane rounds alike; only the order of
// sums differs.
TEST(FitLoops, AgreeWithPlainLoops) {
    const FitPoints shape = someShape("chair");
    const NearestGrid& grid = shape.grid;
    Random random(3);
    constexpr std::size_t kCount = 512;
    const auto x = randomColumn(random, kCount, 0.5);
    const auto y = randomColumn(random, kCount, 0.5);
    const auto z = randomColumn(random, kCount, 0.5);
    const auto weights = randomColumn(random, kCount, 1.0);
    const Gauge gauge{0.0004f, 1.21f, 400.0f};
    std::vector<float> squared(kCount);
    squaredDistances(grid, x.data(), y.data(), z.data(), kCount, gauge, squared.data());
    double sum = 0.0;
    double weight = 0.0;
    std::uint32_t closeness = 0;
    for (std::size_t i = 0; i < kCount; ++i) {
        const NearestGrid::Entry& e = grid.entries()[grid.nearest()[cellOf(grid, x[i], y[i], z[i])]];
        const float dx = x[i] - e.x;
        const float dy = y[i] - e.y;
        const float dz = z[i] - e.z;
        const float off = e.nx * dx + e.ny * dy + e.nz * dz;
        const float along = dx * dx + dy * dy + dz * dz - off * off;
        const float beyond = along - gauge.forgiven;
        const float expected = gauge.unit * (off * off + (beyond > 0.0f ? beyond : 0.0f));
        EXPECT_EQ(squared[i], expected) << i;
        const float near = 1.0f / (1.0f + gauge.overWidth * expected);
        sum += static_cast<double>(weights[i] * near * near);
        weight += static_cast<double>(weights[i]);
        closeness += grid.closeness()[cellOf(grid, x[i], y[i], z[i])];
    }
    const WeightedSum got = explainedBy(grid, x.data(), y.data(), z.data(), weights.data(), kCount, gauge);
    EXPECT_NEAR(static_cast<double>(got.sum), sum, 1e-3);
    EXPECT_NEAR(static_cast<double>(got.weight), weight, 1e-3);
    // Here the places are given in cells.
    std::vector<float> cx, cy, cz;
    for (std::size_t i = 0; i < kCount; ++i) {
        cx.push_back(grid.scale() * x[i]);
        cy.push_back(grid.scale() * y[i]);
        cz.push_back(grid.scale() * z[i]);
    }
    EXPECT_EQ(closenessSum(grid, cx.data(), cy.data(), cz.data(), kCount, grid.offset()), closeness);
}

// A pair's row of the normal equations, in doubles.
TEST(FitLoops, SumTheNormalEquationsOfPlainLoops) {
    const FitPoints shape = someShape("hammer");
    Random random(4);
    constexpr std::size_t kCount = 256;
    const auto x = randomColumn(random, kCount, 0.3);
    const auto y = randomColumn(random, kCount, 0.2);
    const auto z = randomColumn(random, kCount, 0.1);
    const Gauge gauge{0.0f, 1.0f, 100.0f};
    StepSums sums;
    addPairsToQuery(shape.grid, x.data(), y.data(), z.data(), nullptr, kCount, gauge, 0.5f, sums);
    std::array<double, StepSums::kPlane> plane{};
    double points = 0.0;
    for (std::size_t i = 0; i < kCount; ++i) {
        const NearestGrid::Entry& e =
            shape.grid.entries()[shape.grid.nearest()[cellOf(shape.grid, x[i], y[i], z[i])]];
        const Point3 p{static_cast<double>(x[i]), static_cast<double>(y[i]), static_cast<double>(z[i])};
        const Point3 n{static_cast<double>(e.nx), static_cast<double>(e.ny), static_cast<double>(e.nz)};
        const Point3 d =
            p - Point3{static_cast<double>(e.x), static_cast<double>(e.y), static_cast<double>(e.z)};
        const double near = 1.0 / (1.0 + 100.0 * squaredLength(d));
        const double w = 0.5 * near * near * near;
        const Point3 turn = cross(p, n);
        const std::array<double, 8> row = {turn.x, turn.y, turn.z, n.x, n.y, n.z, dot(n, p), dot(n, d)};
        std::size_t at = 0;
        for (std::size_t a = 0; a < 7; ++a) {
            for (std::size_t b = a; b < 8; ++b) plane[at++] += w * row[a] * row[b];
        }
        points += 0.1 * w;
    }
    for (std::size_t k = 0; k < plane.size(); ++k) EXPECT_NEAR(sums.plane[k], plane[k], 1e-4) << k;
    EXPECT_NEAR(sums.point[0], points, 1e-4);
}

}  // namespace
}  // namespace shapedb
