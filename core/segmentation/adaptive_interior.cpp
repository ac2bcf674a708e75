// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/segmentation/adaptive_interior.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "core/base/math.h"
#include "core/base/parallel.h"
#include "core/base/return_if_error.h"
#include "core/geometry/tetrahedron.h"
#include "core/segmentation/bottleneck_angle.h"
#include "core/segmentation/inside_potential.h"
#include "core/segmentation/interior_cost.h"

namespace shapedb {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Degrees: walks at all angles between the least and the largest are compared. Another angle than the
// preferred one costs kAngleWeight times the logarithm of their ratio more.
constexpr double kPreferredAngle = 22.0;
constexpr double kLeastAngle = 12.0;
constexpr double kLargestAngle = 36.0;
constexpr double kAngleWeight = 1.0;

// The potential is taken when it costs less than a walk by more than this: in a noisy scan some points stay
// within a layer, on one side of any boundary.
constexpr double kTolerance = 0.2;

// An interior that bridges more than this is peeled: seen from one side, pliers have a web between their
// handles that must go, but below each handle a bridge that closes it and must stay.
constexpr double kWorthPeeling = 0.15;
// Spacings: narrower facets are not peeled through. Walks leave few webs, and thin parts that peeling could
// lose.
constexpr double kLeastPeel = 5.0;
constexpr double kLeastWalkPeel = 9.0;
// A web is small: peeling that takes more than this of the volume took a body seen from one side.
constexpr double kBodyShare = 0.5;

// The thickened interior: balls of up to this many spacings.
constexpr double kThickness = 3.0;

struct Candidate {
    std::vector<std::uint8_t> inside;
    BoundaryMeasures measures;

    double cost() const { return costOf(measures.separatedFraction, measures.bridged); }
};

Candidate measured(const InteriorCost& cost, std::vector<std::uint8_t> inside) {
    const BoundaryMeasures measures = cost.measure(inside);
    return {std::move(inside), measures};
}

// What walks leave, by the angle in degrees.
NestedInteriors leftByWalks(const std::vector<std::uint8_t>& big, const std::vector<double>& bottlenecks) {
    NestedInteriors walks;
    walks.level.resize(big.size());
    for (std::size_t t = 0; t < big.size(); ++t) {
        walks.level[t] = big[t] != 0 ? bottlenecks[t] / kRadiansPerDegree : -kInfinity;
    }
    walks.low = kLeastAngle;
    walks.high = kLargestAngle;
    walks.preferred = kPreferredAngle;
    walks.preferenceWeight = kAngleWeight;
    return walks;
}

// The width down to which peeling leaves enough of the volume.
double leastWidthFor(const PointCloud& points, const Tetrahedra& tetrahedra,
                     const std::vector<std::uint8_t>& inside, const std::vector<double>& widest) {
    const auto volumeOf = [&](std::uint32_t t) {
        return signedVolume(cornersOf(points, tetrahedra.vertices[t]));
    };
    std::vector<std::uint32_t> order;
    double volume = 0.0;
    for (std::uint32_t t = 0; t < widest.size(); ++t) {
        if (inside[t] == 0) continue;
        order.push_back(t);
        volume += volumeOf(t);
    }
    std::stable_sort(order.begin(), order.end(),
                     [&](std::uint32_t a, std::uint32_t b) { return widest[a] < widest[b]; });
    double left = 0.0;
    for (const std::uint32_t t : order) {
        left += volumeOf(t);
        if (left >= kBodyShare * volume) return widest[t];
    }
    return kInfinity;
}

// What peeling through facets wider than w spacings leaves, by -w.
NestedInteriors leftByPeeling(const PointCloud& points, const Tetrahedra& tetrahedra,
                              const std::vector<double>& spacings, const std::vector<std::uint8_t>& inside,
                              double leastWidth) {
    const std::vector<double> widest = widestWays(points, tetrahedra, spacings, inside);
    NestedInteriors peeled;
    peeled.level.resize(widest.size());
    for (std::size_t t = 0; t < widest.size(); ++t)
        peeled.level[t] = inside[t] != 0 ? -widest[t] : -kInfinity;
    peeled.low = std::numeric_limits<double>::lowest();
    peeled.high = -std::max(leastWidth, leastWidthFor(points, tetrahedra, inside, widest));
    peeled.preferred = -kInfinity;
    return peeled;
}

// The candidate, or what peeling leaves of it if that costs less.
Candidate withoutWebs(const PointCloud& points, const Tetrahedra& tetrahedra,
                      const std::vector<double>& spacings, const InteriorCost& cost, double leastWidth,
                      Candidate candidate) {
    if (candidate.measures.bridged <= kWorthPeeling) return candidate;
    const NestedInteriors peeled = leftByPeeling(points, tetrahedra, spacings, candidate.inside, leastWidth);
    const Threshold best = cost.best(peeled);
    if (best.cost >= candidate.cost()) return candidate;
    return measured(cost, interiorAt(peeled.level, best.value));
}

AdaptiveInterior chosen(Candidate candidate, InteriorSource source, double angleDegrees) {
    const BoundaryMeasures& m = candidate.measures;
    const double quality = m.separatedFraction * m.covered * m.covered;
    return {std::move(candidate.inside), source, angleDegrees, quality};
}

AdaptiveInterior thickened(const PointCloud& points, const Tetrahedra& tetrahedra,
                           const std::vector<double>& spacings) {
    AdaptiveInterior interior;
    interior.source = InteriorSource::kThickened;
    interior.inside.resize(tetrahedra.size());
    for (std::size_t t = 0; t < tetrahedra.size(); ++t) {
        const auto& v = tetrahedra.vertices[t];
        const double spacing = 0.25 * (spacings[v[0]] + spacings[v[1]] + spacings[v[2]] + spacings[v[3]]);
        const bool near = tetrahedra.circumradii[t] <= kThickness * spacing;
        interior.inside[t] = near && signedVolume(cornersOf(points, v)) > 0.0 ? 1 : 0;
    }
    return interior;
}

}  // namespace

Result<AdaptiveInterior> adaptiveInterior(const PointCloud& points, const Tetrahedra& tetrahedra,
                                          const std::vector<std::uint8_t>& big,
                                          const std::vector<double>& spacings, const RunContext& context) {
    std::optional<InteriorCost> made;
    std::optional<Result<std::vector<double>>> angles;
    parallelInvoke([&] { made.emplace(points, tetrahedra, spacings); },
                   [&] { angles.emplace(bottleneckAngles(points, tetrahedra, big, context)); });
    const InteriorCost& cost = *made;
    const Result<std::vector<double>>& bottlenecks = *angles;
    RETURN_IF_ERROR(bottlenecks);
    const auto trimmed = [&](Candidate candidate, double leastWidth) {
        return withoutWebs(points, tetrahedra, spacings, cost, leastWidth, std::move(candidate));
    };
    const NestedInteriors walks = leftByWalks(big, *bottlenecks);
    const Threshold angle = cost.best(walks);
    const auto walk = [&] {
        Candidate candidate = measured(cost, interiorAt(walks.level, angle.value));
        return chosen(trimmed(std::move(candidate), kLeastWalkPeel), InteriorSource::kWalk, angle.value);
    };
    // Costs are not negative, so the potential cannot be clearly better.
    if (angle.cost <= kTolerance) return walk();
    const auto potential = insidePotential(points, tetrahedra, cost.poles(), context);
    RETURN_IF_ERROR(potential);
    std::vector<std::uint8_t> negative(potential->size());
    for (std::size_t t = 0; t < negative.size(); ++t) negative[t] = (*potential)[t] < 0.0 ? 1 : 0;
    Candidate spread = measured(cost, std::move(negative));
    if (angle.cost <= spread.cost() + kTolerance) return walk();
    if (spread.measures.separatedFraction >= kLeastSeparated) {
        return chosen(trimmed(std::move(spread), kLeastPeel), InteriorSource::kPotential, 0.0);
    }
    return thickened(points, tetrahedra, spacings);
}

}  // namespace shapedb
