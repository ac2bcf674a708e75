#include "core/segmentation/adaptive_interior.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "core/base/math.h"
#include "core/base/parallel.h"
#include "core/base/return_if_error.h"
#include "core/geometry/tetrahedron.h"
#include "core/segmentation/bottleneck_angle.h"
#include "core/segmentation/inside_potential.h"

namespace shapedb {

namespace {

// Degrees; the preferred one first, then by distance from it.
constexpr std::array<double, 8> kAngles = {22.0, 20.0, 24.0, 18.0, 26.0, 15.0, 30.0, 34.0};

// A facet is a bridge when its circumradius exceeds this many times the mean spacing of its corners.
constexpr double kBridge = 3.0;

// The cost of an interior is the fraction of points it leaves on one side, plus this times the area it
// bridges (in units of the area that all points stand for). Below one, because an interior that leaks
// through a hole loses all points, while one that closes the hole pays for the hole's area only.
constexpr double kBridgeWeight = 0.5;

// Costs that differ by less are equally good: in a noisy scan some points stay within a layer, on one side
// of any boundary.
constexpr double kTolerance = 0.2;

// An interior that separates a smaller fraction of the points than this has leaked out.
constexpr double kLeastSeparated = 0.35;

// An interior that bridges more than this is peeled: seen from one side, pliers have a web between their
// handles that must go, but below each handle a bridge that closes it and must stay.
constexpr double kWorthPeeling = 0.15;
constexpr std::array<double, 8> kPeelWidths = {48.0, 32.0, 24.0, 16.0, 12.0, 9.0, 7.0, 5.0};
constexpr double kLeastWalkPeel = 9.0;  // walks leave few webs, and thin parts that peeling could lose
// A web is small: peeling that takes more than this of the volume took a body seen from one side.
constexpr double kBodyShare = 0.5;

// The thickened interior: balls of up to this many spacings.
constexpr double kThickness = 3.0;

double volumeOf(const PointCloud& points, const Tetrahedra& tetrahedra,
                const std::vector<std::uint8_t>& inside) {
    double sum = 0.0;
    for (std::size_t t = 0; t < inside.size(); ++t) {
        if (inside[t] != 0) sum += signedVolume(cornersOf(points, tetrahedra.vertices[t]));
    }
    return sum;
}

// Area of a facet, and its circumradius over the mean spacing of its corners.
struct Extent {
    double area = 0.0;
    double width = 0.0;
};

Extent extentOf(const PointCloud& points, const std::array<std::uint32_t, 4>& v, std::size_t i,
                const std::vector<double>& spacings) {
    const std::uint32_t a = v[(i + 1) % 4];
    const std::uint32_t b = v[(i + 2) % 4];
    const std::uint32_t c = v[(i + 3) % 4];
    const Point3 ab = points[b] - points[a];
    const Point3 ac = points[c] - points[a];
    const double area = 0.5 * length(cross(ab, ac));
    // The circumradius is the product of the edges over four times the area.
    const double edges = length(ab) * length(ac) * distance(points[b], points[c]);
    const double spacing = (spacings[a] + spacings[b] + spacings[c]) / 3.0;
    return {area, area > 0.0 ? edges / (4.0 * area * spacing) : INFINITY};
}

struct Facet {
    std::uint32_t tetrahedron = 0;
    std::uint32_t next = kNoTetrahedron;
    double area = 0.0;
    bool bridge = false;
};

std::vector<Facet> measureFacets(const PointCloud& points, const Tetrahedra& tetrahedra,
                                 const std::vector<double>& spacings) {
    std::vector<Facet> facets;
    facets.reserve(2 * tetrahedra.size() + points.size());
    for (std::uint32_t t = 0; t < tetrahedra.size(); ++t) {
        for (std::size_t i = 0; i < 4; ++i) {
            const std::uint32_t next = tetrahedra.neighbours[t][i];
            if (next != kNoTetrahedron && next < t) continue;
            const Extent extent = extentOf(points, tetrahedra.vertices[t], i, spacings);
            facets.push_back({t, next, extent.area, extent.width > kBridge});
        }
    }
    return facets;
}

// `inside` without what can be reached from outside through facets wider than `width` spacings.
std::vector<std::uint8_t> peeled(const PointCloud& points, const Tetrahedra& tetrahedra,
                                 const std::vector<double>& spacings, std::vector<std::uint8_t> inside,
                                 double width) {
    const auto open = [&](std::uint32_t t, std::size_t facet) {
        return extentOf(points, tetrahedra.vertices[t], facet, spacings).width > width;
    };
    std::vector<std::uint32_t> taken;
    for (std::uint32_t t = 0; t < tetrahedra.size(); ++t) {
        for (std::size_t facet = 0; inside[t] != 0 && facet < 4; ++facet) {
            const std::uint32_t next = tetrahedra.neighbours[t][facet];
            if ((next != kNoTetrahedron && inside[next] != 0) || !open(t, facet)) continue;
            inside[t] = 0;
            taken.push_back(t);
        }
    }
    while (!taken.empty()) {
        const std::uint32_t t = taken.back();
        taken.pop_back();
        for (std::size_t facet = 0; facet < 4; ++facet) {
            const std::uint32_t next = tetrahedra.neighbours[t][facet];
            if (next == kNoTetrahedron || inside[next] == 0 || !open(t, facet)) continue;
            inside[next] = 0;
            taken.push_back(next);
        }
    }
    return inside;
}

struct Candidate {
    std::vector<std::uint8_t> inside;
    double separatedFraction = 0.0;  // of the points: those with the boundary between their two poles
    double bridged = 0.0;            // area of bridges over the area that the points stand for
    double covered = 0.0;            // fraction of the boundary's area that is not a bridge

    double cost() const { return kBridgeWeight * bridged + 1.0 - separatedFraction; }
};

class InteriorEvaluator {
  public:
    InteriorEvaluator(const PointCloud& points, const Tetrahedra& tetrahedra,
                      const std::vector<double>& spacings)
        : facets_(measureFacets(points, tetrahedra, spacings)), poles_(findPoles(points, tetrahedra)) {
        for (const double spacing : spacings) pointArea_ += spacing * spacing;
    }

    Candidate evaluate(std::vector<std::uint8_t> inside) const {
        Candidate candidate{std::move(inside)};
        const auto within = [&](std::uint32_t t) { return t != kNoTetrahedron && candidate.inside[t] != 0; };
        double boundary = 0.0;
        double bridges = 0.0;
        for (const Facet& facet : facets_) {
            if (within(facet.tetrahedron) == within(facet.next)) continue;
            boundary += facet.area;
            if (facet.bridge) bridges += facet.area;
        }
        std::size_t separated = 0;
        for (const Poles& poles : poles_) separated += within(poles.first) != within(poles.second);
        candidate.separatedFraction = static_cast<double>(separated) / static_cast<double>(poles_.size());
        candidate.bridged = bridges / pointArea_;
        candidate.covered = boundary > 0.0 ? 1.0 - bridges / boundary : 0.0;
        return candidate;
    }

    const std::vector<Poles>& poles() const { return poles_; }

  private:
    std::vector<Facet> facets_;
    std::vector<Poles> poles_;
    double pointArea_ = 0.0;
};

std::vector<std::uint8_t> leftByWalk(const std::vector<std::uint8_t>& big,
                                     const std::vector<double>& bottlenecks, double angleDegrees) {
    std::vector<std::uint8_t> inside(big.size());
    for (std::size_t t = 0; t < big.size(); ++t) {
        inside[t] = big[t] != 0 && bottlenecks[t] >= toRadians(angleDegrees) ? 1 : 0;
    }
    return inside;
}

// The candidate, or what peeling leaves of it if that costs less.
Candidate withoutWebs(const PointCloud& points, const Tetrahedra& tetrahedra,
                      const std::vector<double>& spacings, const InteriorEvaluator& evaluator,
                      double leastWidth, Candidate candidate) {
    if (candidate.bridged <= kWorthPeeling) return candidate;
    const std::vector<std::uint8_t> whole = candidate.inside;
    const double enough = kBodyShare * volumeOf(points, tetrahedra, whole);
    for (const double width : kPeelWidths) {
        if (width < leastWidth) break;
        Candidate rest = evaluator.evaluate(peeled(points, tetrahedra, spacings, whole, width));
        const bool better = rest.separatedFraction >= kLeastSeparated && rest.cost() < candidate.cost();
        if (better && volumeOf(points, tetrahedra, rest.inside) >= enough) candidate = std::move(rest);
    }
    return candidate;
}

AdaptiveInterior chosen(Candidate candidate, InteriorSource source, double angleDegrees) {
    const double quality = candidate.separatedFraction * candidate.covered * candidate.covered;
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
    std::optional<InteriorEvaluator> made;
    std::optional<Result<std::vector<double>>> angles;
    parallelInvoke([&] { made.emplace(points, tetrahedra, spacings); },
                   [&] { angles.emplace(bottleneckAngles(points, tetrahedra, big, context)); });
    const InteriorEvaluator& evaluator = *made;
    const Result<std::vector<double>>& bottlenecks = *angles;
    RETURN_IF_ERROR(bottlenecks);
    const auto trimmed = [&](Candidate candidate, double leastWidth) {
        return withoutWebs(points, tetrahedra, spacings, evaluator, leastWidth, std::move(candidate));
    };
    Candidate preferred = evaluator.evaluate(leftByWalk(big, *bottlenecks, kAngles[0]));
    // Costs are not negative, so no other interior can be clearly better than this one.
    if (preferred.separatedFraction >= kLeastSeparated && preferred.cost() <= kTolerance) {
        return chosen(trimmed(std::move(preferred), kLeastWalkPeel), InteriorSource::kWalk, kAngles[0]);
    }
    std::array<Candidate, kAngles.size()> walks;
    walks[0] = std::move(preferred);
    double least = walks[0].cost();
    for (std::size_t i = 1; i < kAngles.size(); ++i) {
        walks[i] = evaluator.evaluate(leftByWalk(big, *bottlenecks, kAngles[i]));
        least = std::min(least, walks[i].cost());
    }
    const auto potential = insidePotential(points, tetrahedra, evaluator.poles(), context);
    RETURN_IF_ERROR(potential);
    std::vector<std::uint8_t> negative(potential->size());
    for (std::size_t t = 0; t < negative.size(); ++t) negative[t] = (*potential)[t] < 0.0 ? 1 : 0;
    Candidate spread = evaluator.evaluate(std::move(negative));
    least = std::min(least, spread.cost());
    for (std::size_t i = 0; i < kAngles.size(); ++i) {
        if (walks[i].separatedFraction < kLeastSeparated || walks[i].cost() > least + kTolerance) continue;
        return chosen(trimmed(std::move(walks[i]), kLeastWalkPeel), InteriorSource::kWalk, kAngles[i]);
    }
    if (spread.separatedFraction >= kLeastSeparated)
        return chosen(trimmed(std::move(spread), 0.0), InteriorSource::kPotential, 0.0);
    return thickened(points, tetrahedra, spacings);
}

}  // namespace shapedb
