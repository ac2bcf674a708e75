// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/segmentation/interior_cost.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace shapedb {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// A facet is a bridge when its circumradius exceeds this many times the mean spacing of its corners.
constexpr double kBridge = 3.0;

// Below one, because an interior that leaks through a hole loses all points, while one that closes the hole
// pays for the hole's area only.
constexpr double kBridgeWeight = 0.5;

// What changes as the threshold rises past a level.
struct Change {
    double level = 0.0;
    double bridged = 0.0;
    int separated = 0;  // points
};

}  // namespace

FacetExtent facetExtent(const PointCloud& points, const Tetrahedra& tetrahedra, std::size_t tetrahedron,
                        std::size_t facet, const std::vector<double>& spacings) {
    const auto& v = tetrahedra.vertices[tetrahedron];
    const std::uint32_t a = v[(facet + 1) % 4];
    const std::uint32_t b = v[(facet + 2) % 4];
    const std::uint32_t c = v[(facet + 3) % 4];
    const Point3 ab = points[b] - points[a];
    const Point3 ac = points[c] - points[a];
    const double area = 0.5 * length(cross(ab, ac));
    // The circumradius is the product of the edges over four times the area.
    const double edges = length(ab) * length(ac) * distance(points[b], points[c]);
    const double spacing = (spacings[a] + spacings[b] + spacings[c]) / 3.0;
    return {area, area > 0.0 ? edges / (4.0 * area * spacing) : kInfinity};
}

double costOf(double separatedFraction, double bridged) {
    return kBridgeWeight * bridged + 1.0 - separatedFraction;
}

std::vector<std::uint8_t> interiorAt(const std::vector<double>& level, double threshold) {
    std::vector<std::uint8_t> inside(level.size());
    for (std::size_t t = 0; t < level.size(); ++t) inside[t] = level[t] >= threshold ? 1 : 0;
    return inside;
}

InteriorCost::InteriorCost(const PointCloud& points, const Tetrahedra& tetrahedra,
                           const std::vector<double>& spacings)
    : facets_(measureFacets(points, tetrahedra, spacings)), poles_(findPoles(points, tetrahedra)) {
    for (const double spacing : spacings) pointArea_ += spacing * spacing;
}

std::vector<InteriorCost::Facet> InteriorCost::measureFacets(const PointCloud& points,
                                                             const Tetrahedra& tetrahedra,
                                                             const std::vector<double>& spacings) {
    std::vector<Facet> facets;
    facets.reserve(2 * tetrahedra.size() + points.size());
    for (std::uint32_t t = 0; t < tetrahedra.size(); ++t) {
        for (std::size_t i = 0; i < 4; ++i) {
            const std::uint32_t next = tetrahedra.neighbours[t][i];
            if (next != kNoTetrahedron && next < t) continue;
            const FacetExtent extent = facetExtent(points, tetrahedra, t, i, spacings);
            facets.push_back({t, next, extent.area, extent.width > kBridge});
        }
    }
    return facets;
}

BoundaryMeasures InteriorCost::measure(const std::vector<std::uint8_t>& inside) const {
    const auto within = [&](std::uint32_t t) { return t != kNoTetrahedron && inside[t] != 0; };
    double boundary = 0.0;
    double bridges = 0.0;
    for (const Facet& facet : facets_) {
        if (within(facet.tetrahedron) == within(facet.next)) continue;
        boundary += facet.area;
        if (facet.bridge) bridges += facet.area;
    }
    std::size_t separated = 0;
    for (const Poles& poles : poles_) separated += within(poles.first) != within(poles.second);
    BoundaryMeasures measures;
    measures.separatedFraction = static_cast<double>(separated) / static_cast<double>(poles_.size());
    measures.bridged = bridges / pointArea_;
    measures.covered = boundary > 0.0 ? 1.0 - bridges / boundary : 0.0;
    return measures;
}

// A facet lies on the boundary, and a point is separated, for the thresholds between the levels of its two
// tetrahedra: one pass over these ends gives all costs.
std::vector<CostStep> InteriorCost::steps(const std::vector<double>& level) const {
    const auto levelOf = [&](std::uint32_t t) { return t == kNoTetrahedron ? -kInfinity : level[t]; };
    std::vector<Change> changes;
    const auto addBetween = [&](std::uint32_t t, std::uint32_t u, double bridged, int separated) {
        const auto [low, high] = std::minmax({levelOf(t), levelOf(u)});
        if (low == high) return;
        changes.push_back({low, bridged, separated});
        changes.push_back({high, -bridged, -separated});
    };
    for (const Facet& facet : facets_) {
        if (facet.bridge) addBetween(facet.tetrahedron, facet.next, facet.area / pointArea_, 0);
    }
    for (const Poles& poles : poles_) addBetween(poles.first, poles.second, 0.0, 1);
    std::stable_sort(changes.begin(), changes.end(),
                     [](const Change& a, const Change& b) { return a.level < b.level; });
    std::vector<CostStep> steps;
    double bridged = 0.0;
    std::int64_t separated = 0;
    for (std::size_t i = 0; i < changes.size() && changes[i].level < kInfinity;) {
        const double above = changes[i].level;
        for (; i < changes.size() && changes[i].level == above; ++i) {
            bridged += changes[i].bridged;
            separated += changes[i].separated;
        }
        const double fraction = static_cast<double>(separated) / static_cast<double>(poles_.size());
        steps.push_back({above, i < changes.size() ? changes[i].level : kInfinity, fraction, bridged});
    }
    return steps;
}

Threshold InteriorCost::best(const NestedInteriors& interiors) const {
    Threshold best{0.0, kInfinity};
    for (const CostStep& step : steps(interiors.level)) {
        const double first = std::max(std::nextafter(step.above, kInfinity), interiors.low);
        const double last = std::min(step.upTo, interiors.high);
        if (first > last || step.separatedFraction < kLeastSeparated) continue;
        const double value = std::clamp(interiors.preferred, first, last);
        double cost = costOf(step.separatedFraction, step.bridged);
        if (interiors.preferenceWeight > 0.0) {
            cost += interiors.preferenceWeight * std::abs(std::log(value / interiors.preferred));
        }
        if (cost < best.cost) best = {value, cost};
    }
    return best;
}

}  // namespace shapedb
