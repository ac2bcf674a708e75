// SPDX-License-Identifier: GPL-3.0-or-later
// The sweep over nested interiors against costs computed anew for every single one.
#include "core/segmentation/interior_cost.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <set>

#include <gtest/gtest.h>

#include "core/base/math.h"
#include "core/base/random.h"
#include "core/geometry/neighbours.h"
#include "core/segmentation/bottleneck_angle.h"
#include "core/segmentation/interior.h"
#include "tests/core/segmentation/small_clouds.h"

namespace shapedb {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Circumradius of a facet over the mean spacing of its corners, by the law of sines.
double widthOf(const Triangulated& cloud, const std::vector<double>& spacings, std::size_t t, std::size_t f) {
    const auto& v = cloud.tetrahedra.vertices[t];
    const std::uint32_t i = v[f == 0 ? 1 : 0];
    const std::uint32_t j = v[f <= 1 ? 2 : 1];
    const std::uint32_t k = v[f <= 2 ? 3 : 2];
    const Point3 a = cloud.points[j] - cloud.points[i];
    const Point3 b = cloud.points[k] - cloud.points[i];
    const double sine = length(cross(a, b)) / (length(a) * length(b));
    const double radius = distance(cloud.points[j], cloud.points[k]) / (2.0 * sine);
    return radius / ((spacings[i] + spacings[j] + spacings[k]) / 3.0);
}

struct Cost {
    double separatedFraction = 0.0;
    double bridged = 0.0;
    double total() const { return 1.0 - separatedFraction + 0.5 * bridged; }
};

// Looks at each tetrahedron of an interior and its four facets.
class Reference {
  public:
    explicit Reference(const Triangulated& cloud)
        : tetrahedra_(cloud.tetrahedra),
          spacings_(localSpacings(cloud.points).value()),
          poles_(findPoles(cloud.points, cloud.tetrahedra)) {
        double area = 0.0;
        for (const double spacing : spacings_) area += spacing * spacing;
        for (std::size_t t = 0; t < tetrahedra_.size(); ++t) {
            const std::array<Point3, 4> corners = cornersOf(cloud, t);
            bridges_.emplace_back();
            for (std::size_t f = 0; f < 4; ++f) {
                const Point3& a = corners[(f + 1) % 4];
                const Point3& b = corners[(f + 2) % 4];
                const Point3& c = corners[(f + 3) % 4];
                const bool wide = widthOf(cloud, spacings_, t, f) > 3.0;
                bridges_[t][f] = wide ? 0.5 * length(cross(b - a, c - a)) / area : 0.0;
            }
        }
    }

    const std::vector<double>& spacings() const { return spacings_; }

    Cost costOf(const std::vector<std::uint8_t>& inside) const {
        Cost cost;
        const auto within = [&](std::uint32_t t) { return t != kNoTetrahedron && inside[t] != 0; };
        for (std::size_t t = 0; t < inside.size(); ++t) {
            for (std::size_t f = 0; inside[t] && f < 4; ++f) {
                if (!within(tetrahedra_.neighbours[t][f])) cost.bridged += bridges_[t][f];
            }
        }
        std::size_t separated = 0;
        for (const Poles& poles : poles_) separated += within(poles.first) != within(poles.second) ? 1 : 0;
        cost.separatedFraction = static_cast<double>(separated) / static_cast<double>(poles_.size());
        return cost;
    }

  private:
    const Tetrahedra& tetrahedra_;
    std::vector<double> spacings_;
    std::vector<Poles> poles_;
    std::vector<std::array<double, 4>> bridges_;  // area of each facet in the cost, 0: no bridge
};

// Levels as walks make them, and random ones with many ties.
std::vector<std::vector<double>> levelsOf(const Triangulated& cloud, const std::vector<double>& spacings) {
    const auto big = bigBalls(cloud.tetrahedra, spacings, 0.5);
    std::vector<double> walks = bottleneckAngles(cloud.points, cloud.tetrahedra, big).value();
    for (std::size_t t = 0; t < walks.size(); ++t) walks[t] = big[t] ? toDegrees(walks[t]) : -kInfinity;
    Random random(7);
    std::vector<double> ties(walks.size());
    for (double& level : ties) level = std::floor(random.uniform(0.0, 20.0));
    return {walks, ties};
}

TEST(InteriorCost, OfEveryStepIsThatOfItsInteriorMeasuredAnew) {
    for (const Triangulated& cloud : triangulatedClouds()) {
        const Reference reference(cloud);
        const InteriorCost cost(cloud.points, cloud.tetrahedra, reference.spacings());
        for (const std::vector<double>& level : levelsOf(cloud, reference.spacings())) {
            double reached = -kInfinity;
            for (const CostStep& step : cost.steps(level)) {
                EXPECT_EQ(step.above, reached) << cloud.name;
                reached = step.upTo;
                const auto inside = interiorAt(level, std::nextafter(step.above, kInfinity));
                const Cost anew = reference.costOf(inside);
                ASSERT_EQ(step.separatedFraction, anew.separatedFraction) << cloud.name << " " << step.above;
                ASSERT_NEAR(step.bridged, anew.bridged, 1e-9) << cloud.name << " " << step.above;
                const BoundaryMeasures measures = cost.measure(inside);
                ASSERT_EQ(measures.separatedFraction, anew.separatedFraction) << cloud.name;
                ASSERT_NEAR(measures.bridged, anew.bridged, 1e-9) << cloud.name;
                ASSERT_NEAR(costOf(step.separatedFraction, step.bridged), anew.total(), 1e-9) << cloud.name;
            }
        }
    }
}

// Each interior at its threshold nearest to the preferred one: the levels, the ends of the range, and, since
// an interior also ends just above the level before, the numbers next to the levels.
double leastCost(const Reference& reference, const NestedInteriors& interiors) {
    std::set<double> thresholds = {interiors.low, interiors.high, interiors.preferred};
    for (const double level : interiors.level) thresholds.insert({level, std::nextafter(level, kInfinity)});
    double least = kInfinity;
    for (const double threshold : thresholds) {
        if (!(threshold >= interiors.low && threshold <= interiors.high)) continue;
        const Cost anew = reference.costOf(interiorAt(interiors.level, threshold));
        if (anew.separatedFraction < kLeastSeparated) continue;
        const double away = std::abs(std::log(threshold / interiors.preferred));
        least = std::min(least, anew.total() + interiors.preferenceWeight * away);
    }
    return least;
}

TEST(InteriorCost, BestIsTheLeastOfAllThresholdsByBruteForce) {
    std::size_t found = 0;
    for (const Triangulated& cloud : triangulatedClouds()) {
        const Reference reference(cloud);
        const InteriorCost cost(cloud.points, cloud.tetrahedra, reference.spacings());
        for (const std::vector<double>& level : levelsOf(cloud, reference.spacings())) {
            for (const double weight : {0.0, 0.1, 1.0}) {
                const NestedInteriors interiors{level, 2.0, 36.0, 9.5, weight};
                const Threshold best = cost.best(interiors);
                const double least = leastCost(reference, interiors);
                if (std::isinf(least)) {
                    EXPECT_TRUE(std::isinf(best.cost)) << cloud.name;
                    continue;
                }
                ++found;
                ASSERT_NEAR(best.cost, least, 1e-9) << cloud.name << " " << weight;
                ASSERT_GE(best.value, interiors.low) << cloud.name;
                ASSERT_LE(best.value, interiors.high) << cloud.name;
                const Cost anew = reference.costOf(interiorAt(level, best.value));
                const double away = std::abs(std::log(best.value / interiors.preferred));
                ASSERT_NEAR(anew.total() + weight * away, best.cost, 1e-9) << cloud.name;
            }
        }
    }
    EXPECT_GT(found, 20u);
}

// `inside` without what can be reached from outside through facets wider than `width`.
std::vector<std::uint8_t> peeled(const Triangulated& cloud, const std::vector<double>& spacings,
                                 std::vector<std::uint8_t> inside, double width) {
    for (bool changed = true; changed;) {
        changed = false;
        for (std::size_t t = 0; t < inside.size(); ++t) {
            for (std::size_t f = 0; inside[t] && f < 4; ++f) {
                const std::uint32_t next = cloud.tetrahedra.neighbours[t][f];
                if ((next != kNoTetrahedron && inside[next]) || !(widthOf(cloud, spacings, t, f) > width)) {
                    continue;
                }
                inside[t] = 0;
                changed = true;
            }
        }
    }
    return inside;
}

TEST(WidestWays, AreTheWidthsAtWhichPeelingTakesATetrahedron) {
    for (const Triangulated& cloud : triangulatedClouds()) {
        const auto spacings = localSpacings(cloud.points).value();
        Random random(3);
        std::vector<std::uint8_t> inside(cloud.tetrahedra.size());
        for (auto& in : inside) in = random.uniform() < 0.8 ? 1 : 0;
        const auto widest = widestWays(cloud.points, cloud.tetrahedra, spacings, inside);
        for (const double width : {0.4, 0.7, 1.1, 1.7, 2.3, 3.1, 5.3, 9.7}) {
            const auto left = peeled(cloud, spacings, inside, width);
            for (std::size_t t = 0; t < inside.size(); ++t) {
                if (!inside[t]) {
                    ASSERT_EQ(widest[t], -kInfinity) << cloud.name;
                } else {
                    ASSERT_EQ(left[t] != 0, widest[t] <= width) << cloud.name << " " << t << " " << width;
                }
            }
        }
    }
}

}  // namespace
}  // namespace shapedb
