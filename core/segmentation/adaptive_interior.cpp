#include "core/segmentation/adaptive_interior.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "core/base/parallel.h"
#include "core/base/return_if_error.h"
#include "core/segmentation/bottleneck_angle.h"
#include "core/segmentation/inside_potential.h"

namespace shapedb {

namespace {

constexpr double kRadiansPerDegree = 3.14159265358979323846 / 180.0;

// By distance from the preferred angle.
constexpr std::array<double, 8> kAngles = {22.0, 20.0, 24.0, 18.0, 26.0, 15.0, 30.0, 34.0};

// A facet is a bridge when its circumradius exceeds this many times the mean scale of its corners.
constexpr double kBridge = 3.0;

// The cost of an interior is the share of points it leaves on one side plus this times the area it
// bridges (in units of the area all points stand for). Below one: a hole left open costs all points,
// closing it costs its area.
constexpr double kBridgeWeight = 0.5;

// Costs that differ by less do not tell which is better: smoothing leaves some points of a noisy
// scan within a layer, on one side of any boundary.
constexpr double kTolerance = 0.2;

// An interior whose boundary parts fewer points than this has leaked out.
constexpr double kLeastParted = 0.35;

// An interior that bridges more than this is peeled: between the handles of pliers seen from one side
// there is a web that nothing holds, below each handle a bridge that closes it.
constexpr double kWorthPeeling = 0.15;
constexpr std::array<double, 8> kPeelWidths = {48.0, 32.0, 24.0, 16.0, 12.0, 9.0, 7.0, 5.0};
constexpr double kLeastWalkPeel = 9.0;  // what a walk leaves has few webs, and thin parts to lose
// Webs are the smaller part: what loses more of its volume was no web but a body seen from one side.
constexpr double kBodyShare = 0.5;

// The thickened interior: balls up to this many scales.
constexpr double kThickness = 3.0;

double volumeOf(const PointCloud& points, const std::array<std::uint32_t, 4>& v) {
    const Point3& o = points[v[0]];
    return dot(points[v[1]] - o, cross(points[v[2]] - o, points[v[3]] - o)) / 6.0;
}

double volumeOf(const PointCloud& points, const Tetrahedra& tetrahedra,
                const std::vector<std::uint8_t>& inside) {
    double sum = 0.0;
    for (std::size_t t = 0; t < inside.size(); ++t) {
        if (inside[t] != 0) sum += volumeOf(points, tetrahedra.vertices[t]);
    }
    return sum;
}

// Area of facet i, and its circumradius in mean scales of its corners.
struct Extent {
    double area = 0.0;
    double width = 0.0;
};

Extent extentOf(const PointCloud& points, const std::array<std::uint32_t, 4>& v, std::size_t i,
                const std::vector<double>& scales) {
    const std::uint32_t a = v[(i + 1) % 4];
    const std::uint32_t b = v[(i + 2) % 4];
    const std::uint32_t c = v[(i + 3) % 4];
    const Point3 ab = points[b] - points[a];
    const Point3 ac = points[c] - points[a];
    const double area = 0.5 * length(cross(ab, ac));
    // The circumradius is the product of the edges over four times the area.
    const double edges = length(ab) * length(ac) * distance(points[b], points[c]);
    const double scale = (scales[a] + scales[b] + scales[c]) / 3.0;
    return {area, area > 0.0 ? edges / (4.0 * area * scale) : INFINITY};
}

struct Facet {
    std::uint32_t tetrahedron = 0;
    std::uint32_t next = kNoTetrahedron;
    double area = 0.0;
    bool bridge = false;
};

std::vector<Facet> measureFacets(const PointCloud& points, const Tetrahedra& tetrahedra,
                                 const std::vector<double>& scales) {
    std::vector<Facet> facets;
    facets.reserve(2 * tetrahedra.size() + points.size());
    for (std::uint32_t t = 0; t < tetrahedra.size(); ++t) {
        for (std::size_t i = 0; i < 4; ++i) {
            const std::uint32_t next = tetrahedra.neighbours[t][i];
            if (next != kNoTetrahedron && next < t) continue;
            const Extent extent = extentOf(points, tetrahedra.vertices[t], i, scales);
            facets.push_back({t, next, extent.area, extent.width > kBridge});
        }
    }
    return facets;
}

// What is left when everything that can be reached from outside through facets wider than
// `width` scales is taken away.
std::vector<std::uint8_t> peeled(const PointCloud& points, const Tetrahedra& tetrahedra,
                                 const std::vector<double>& scales, std::vector<std::uint8_t> inside,
                                 double width) {
    const auto open = [&](std::uint32_t t, std::size_t facet) {
        return extentOf(points, tetrahedra.vertices[t], facet, scales).width > width;
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
    double separatedFraction = 0.0;  // share of the points
    double bridged = 0.0;            // area of bridges over the area that the points stand for
    double covered = 0.0;            // share of the boundary that is no bridge

    double cost() const { return kBridgeWeight * bridged + 1.0 - separatedFraction; }
};

class InteriorEvaluator {
  public:
    InteriorEvaluator(const PointCloud& points, const Tetrahedra& tetrahedra,
                      const std::vector<double>& scales)
        : facets_(measureFacets(points, tetrahedra, scales)), poles_(findPoles(points, tetrahedra)) {
        for (const double scale : scales) pointArea_ += scale * scale;
    }

    Candidate judged(std::vector<std::uint8_t> inside) const {
        Candidate candidate{std::move(inside)};
        const auto within = [&](std::uint32_t t) { return t != kNoTetrahedron && candidate.inside[t] != 0; };
        double boundary = 0.0;
        double bridges = 0.0;
        for (const Facet& facet : facets_) {
            if (within(facet.tetrahedron) == within(facet.next)) continue;
            boundary += facet.area;
            if (facet.bridge) bridges += facet.area;
        }
        std::size_t separatedFraction = 0;
        for (const Poles& poles : poles_) separatedFraction += within(poles.first) != within(poles.second);
        candidate.separatedFraction =
            static_cast<double>(separatedFraction) / static_cast<double>(poles_.size());
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

std::vector<std::uint8_t> leftByWalk(const std::vector<std::uint8_t>& big, const std::vector<double>& leaks,
                                     double angleDegrees) {
    std::vector<std::uint8_t> inside(big.size());
    for (std::size_t t = 0; t < big.size(); ++t) {
        inside[t] = big[t] != 0 && leaks[t] >= angleDegrees * kRadiansPerDegree ? 1 : 0;
    }
    return inside;
}

// The candidate, or what is left of it when webs are peeled off, if that costs less.
Candidate withoutWebs(const PointCloud& points, const Tetrahedra& tetrahedra,
                      const std::vector<double>& scales, const InteriorEvaluator& judge, double leastWidth,
                      Candidate candidate) {
    if (candidate.bridged <= kWorthPeeling) return candidate;
    const std::vector<std::uint8_t> whole = candidate.inside;
    const double enough = kBodyShare * volumeOf(points, tetrahedra, whole);
    for (const double width : kPeelWidths) {
        if (width < leastWidth) break;
        Candidate rest = judge.judged(peeled(points, tetrahedra, scales, whole, width));
        const bool better = rest.separatedFraction >= kLeastParted && rest.cost() < candidate.cost();
        if (better && volumeOf(points, tetrahedra, rest.inside) >= enough) candidate = std::move(rest);
    }
    return candidate;
}

AdaptiveInterior chosen(Candidate candidate, InteriorSource source, double angleDegrees) {
    const double quality = candidate.separatedFraction * candidate.covered * candidate.covered;
    return {std::move(candidate.inside), source, angleDegrees, quality};
}

AdaptiveInterior thickened(const PointCloud& points, const Tetrahedra& tetrahedra,
                           const std::vector<double>& scales) {
    AdaptiveInterior interior;
    interior.source = InteriorSource::kThickened;
    interior.inside.resize(tetrahedra.size());
    for (std::size_t t = 0; t < tetrahedra.size(); ++t) {
        const auto& v = tetrahedra.vertices[t];
        const double scale = 0.25 * (scales[v[0]] + scales[v[1]] + scales[v[2]] + scales[v[3]]);
        const bool near = tetrahedra.circumradii[t] <= kThickness * scale;
        interior.inside[t] = near && volumeOf(points, v) > 0.0 ? 1 : 0;
    }
    return interior;
}

}  // namespace

Result<AdaptiveInterior> adaptiveInterior(const PointCloud& points, const Tetrahedra& tetrahedra,
                                          const std::vector<std::uint8_t>& big,
                                          const std::vector<double>& scales, const RunContext& context) {
    std::optional<InteriorEvaluator> made;
    std::optional<Result<std::vector<double>>> angles;
    parallelInvoke([&] { made.emplace(points, tetrahedra, scales); },
                   [&] { angles.emplace(bottleneckAngles(points, tetrahedra, big, context)); });
    const InteriorEvaluator& judge = *made;
    const Result<std::vector<double>>& leaks = *angles;
    RETURN_IF_ERROR(leaks);
    const auto trimmed = [&](Candidate candidate, double leastWidth) {
        return withoutWebs(points, tetrahedra, scales, judge, leastWidth, std::move(candidate));
    };
    Candidate preferred = judge.judged(leftByWalk(big, *leaks, kAngles[0]));
    // No other interior costs less than nothing, so none can be clearly better than this one.
    if (preferred.separatedFraction >= kLeastParted && preferred.cost() <= kTolerance) {
        return chosen(trimmed(std::move(preferred), kLeastWalkPeel), InteriorSource::kWalk, kAngles[0]);
    }
    std::array<Candidate, kAngles.size()> walks;
    walks[0] = std::move(preferred);
    double least = walks[0].cost();
    for (std::size_t i = 1; i < kAngles.size(); ++i) {
        walks[i] = judge.judged(leftByWalk(big, *leaks, kAngles[i]));
        least = std::min(least, walks[i].cost());
    }
    const auto potential = insidePotential(points, tetrahedra, judge.poles(), context);
    RETURN_IF_ERROR(potential);
    std::vector<std::uint8_t> negative(potential->size());
    for (std::size_t t = 0; t < negative.size(); ++t) negative[t] = (*potential)[t] < 0.0 ? 1 : 0;
    Candidate spread = judge.judged(std::move(negative));
    least = std::min(least, spread.cost());
    for (std::size_t i = 0; i < kAngles.size(); ++i) {
        if (walks[i].separatedFraction < kLeastParted || walks[i].cost() > least + kTolerance) continue;
        return chosen(trimmed(std::move(walks[i]), kLeastWalkPeel), InteriorSource::kWalk, kAngles[i]);
    }
    if (spread.separatedFraction >= kLeastParted)
        return chosen(trimmed(std::move(spread), 0.0), InteriorSource::kPotential, 0.0);
    return thickened(points, tetrahedra, scales);
}

}  // namespace shapedb
