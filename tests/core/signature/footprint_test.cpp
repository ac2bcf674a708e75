// SPDX-License-Identifier: GPL-3.0-or-later
// Shapes with known outlines, seen from one side and from all sides.
#include "core/signature/footprint.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "core/base/random.h"
#include "core/geometry/motion.h"

namespace shapedb {
namespace {

// Points of a lying spoon of length about 1: a bowl half as wide as long, and a handle. `sides`: 1 for the
// upper side alone, 2 with the lower one, `thickness` below.
PointCloud spoon(int sides, double thickness, std::uint64_t seed, std::size_t count = 6000) {
    Random random(seed);
    PointCloud points;
    while (points.size() < count) {
        const double x = random.uniform(0.0, 1.0);
        const double y = random.uniform(-0.15, 0.15);
        const double u = (x - 0.15) / 0.15;
        const bool bowl = u * u + y * y / (0.12 * 0.12) < 1.0;
        const bool handle = x > 0.25 && std::abs(y) < 0.03;
        if (!bowl && !handle) continue;
        const double z = sides == 2 && random.uniform() < 0.5 ? -thickness : 0.0;
        points.push_back({x, y, z + 0.002 * random.normal()});
    }
    return points;
}

// The distribution of the outline along its length, in ten shares, the same from either end.
std::vector<double> profile(const std::vector<OutlinePoint>& outline) {
    std::vector<double> shares(10, 0.0);
    for (const OutlinePoint& p : outline) {
        const double place = std::clamp(10.0 * p[0], 0.0, 9.0);
        shares[static_cast<std::size_t>(place)] += 1.0 / static_cast<double>(outline.size());
    }
    if (shares.front() + shares[1] < shares.back() + shares[8]) std::reverse(shares.begin(), shares.end());
    return shares;
}

double difference(const std::vector<double>& a, const std::vector<double>& b) {
    double sum = 0.0;
    for (std::size_t i = 0; i < a.size(); ++i) sum += std::abs(a[i] - b[i]);
    return sum;
}

TEST(Footprint, IsTheSameFromOneSideAndFromBoth) {
    const auto one = profile(footprint(spoon(1, 0.0, 1)));
    const auto both = profile(footprint(spoon(2, 0.05, 2)));
    EXPECT_LT(difference(one, both), 0.06);
    // Each cell counts once: twice the points under the bowl change nothing.
    PointCloud bowlTwice = spoon(1, 0.0, 3);
    const std::size_t once = bowlTwice.size();
    for (std::size_t i = 0; i < once; ++i) {
        if (bowlTwice[i].x < 0.3) bowlTwice.push_back(bowlTwice[i] + Point3{0.001, 0.001, -0.02});
    }
    EXPECT_LT(difference(one, profile(footprint(bowlTwice))), 0.1);
}

TEST(Footprint, DoesNotDependOnThePose) {
    const PointCloud still = spoon(2, 0.05, 4);
    const auto expected = profile(footprint(still));
    Random random(5);
    for (int round = 0; round < 8; ++round) {
        const Matrix3 turn = randomRotation(random);
        const double mirror = round % 2 == 0 ? 1.0 : -1.0;
        PointCloud moved;
        for (const Point3& p : still) {
            moved.push_back(3.0 * rotate(turn, {p.x, p.y, mirror * p.z}) + Point3{5.0, -2.0, 1.0});
        }
        EXPECT_LT(difference(expected, profile(footprint(moved))), 0.04) << round;
    }
}

// Counts the cells with a map, for points with known axes.
TEST(Footprint, HasOnePointPerCell) {
    Random random(6);
    PointCloud points;
    for (int i = 0; i < 5000; ++i) {
        points.push_back({random.uniform(-1.0, 1.0), random.uniform(-0.3, 0.3), random.uniform(-0.02, 0.02)});
    }
    const auto outline = footprint(points);
    ASSERT_FALSE(outline.empty());
    // An evenly filled rectangle of 1 by 0.3 in units of its length (apart from the tails).
    double across = 0.0;
    std::size_t beyond = 0;
    for (const OutlinePoint& p : outline) {
        across = std::max(across, std::abs(p[1]));
        if (p[0] < 0.0 || p[0] > 1.0) ++beyond;
    }
    EXPECT_NEAR(across, 0.15, 0.01);
    EXPECT_LE(beyond, outline.size() / 50);
    // Hardly two in a cell: 2 by 0.6 holds about as many cells of two spacings.
    std::map<std::pair<long, long>, int> occupied;
    const double cell = std::sqrt(0.3 / static_cast<double>(outline.size()));
    for (const OutlinePoint& p : outline) {
        ++occupied[{std::lround(std::floor(p[0] / cell)), std::lround(std::floor(p[1] / cell))}];
    }
    for (const auto& [key, count] : occupied) EXPECT_LE(count, 5) << key.first << " " << key.second;
    EXPECT_LT(outline.size(), points.size() / 2);
    EXPECT_EQ(outline, footprint(points)) << "deterministic";
}

TEST(Footprint, HandlesVeryFewPoints) {
    EXPECT_FALSE(footprint({{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}).empty());
    EXPECT_TRUE(footprint({{1, 1, 1}, {1, 1, 1}, {1, 1, 1}, {1, 1, 1}}).empty()) << "no extent";
}

}  // namespace
}  // namespace shapedb
