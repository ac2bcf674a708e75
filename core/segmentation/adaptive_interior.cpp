#include "core/segmentation/adaptive_interior.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "core/segmentation/inside_potential.h"
#include "core/segmentation/leak_angle.h"

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

// The thickened interior: balls up to this many scales.
constexpr double kThickness = 3.0;

double volumeOf(const PointCloud& points, const std::array<std::uint32_t, 4>& v) {
    const Point3& o = points[v[0]];
    return dot(points[v[1]] - o, cross(points[v[2]] - o, points[v[3]] - o)) / 6.0;
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
        const auto& v = tetrahedra.vertices[t];
        for (std::size_t i = 0; i < 4; ++i) {
            const std::uint32_t next = tetrahedra.neighbours[t][i];
            if (next != kNoTetrahedron && next < t) continue;
            const std::uint32_t a = v[(i + 1) % 4];
            const std::uint32_t b = v[(i + 2) % 4];
            const std::uint32_t c = v[(i + 3) % 4];
            const Point3 ab = points[b] - points[a];
            const Point3 ac = points[c] - points[a];
            const double area = 0.5 * length(cross(ab, ac));
            // The circumradius is the product of the edges over four times the area.
            const double edges = length(ab) * length(ac) * distance(points[b], points[c]);
            const double limit = kBridge * (scales[a] + scales[b] + scales[c]) / 3.0;
            facets.push_back({t, next, area, edges > limit * 4.0 * area});
        }
    }
    return facets;
}

struct Candidate {
    std::vector<std::uint8_t> inside;
    double parted = 0.0;   // share of the points
    double bridged = 0.0;  // area of bridges over the area that the points stand for
    double covered = 0.0;  // share of the boundary that is no bridge

    double cost() const { return kBridgeWeight * bridged + 1.0 - parted; }
};

class Judge {
  public:
    Judge(const PointCloud& points, const Tetrahedra& tetrahedra, const std::vector<double>& scales)
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
        std::size_t parted = 0;
        for (const Poles& poles : poles_) parted += within(poles.first) != within(poles.second);
        candidate.parted = static_cast<double>(parted) / static_cast<double>(poles_.size());
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

AdaptiveInterior chosen(Candidate candidate, InteriorSource source, double angleDegrees) {
    const double quality = candidate.parted * candidate.covered * candidate.covered;
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

const char* interiorSourceName(InteriorSource source) noexcept {
    switch (source) {
        case InteriorSource::kWalk: return "walk";
        case InteriorSource::kPotential: return "potential";
        case InteriorSource::kThickened: return "thickened";
    }
    return "walk";
}

Result<AdaptiveInterior> adaptiveInterior(const PointCloud& points, const Tetrahedra& tetrahedra,
                                          const std::vector<std::uint8_t>& big,
                                          const std::vector<double>& scales, const RunContext& context) {
    const Judge judge(points, tetrahedra, scales);
    const auto leaks = leakAngles(points, tetrahedra, big, context);
    if (!leaks) return fail(leaks.error());
    Candidate preferred = judge.judged(leftByWalk(big, *leaks, kAngles[0]));
    // No other interior costs less than nothing, so none can be clearly better than this one.
    if (preferred.parted >= kLeastParted && preferred.cost() <= kTolerance) {
        return chosen(std::move(preferred), InteriorSource::kWalk, kAngles[0]);
    }
    std::array<Candidate, kAngles.size()> walks;
    walks[0] = std::move(preferred);
    double least = walks[0].cost();
    for (std::size_t i = 1; i < kAngles.size(); ++i) {
        walks[i] = judge.judged(leftByWalk(big, *leaks, kAngles[i]));
        least = std::min(least, walks[i].cost());
    }
    const auto potential = insidePotential(points, tetrahedra, judge.poles(), context);
    if (!potential) return fail(potential.error());
    std::vector<std::uint8_t> negative(potential->size());
    for (std::size_t t = 0; t < negative.size(); ++t) negative[t] = (*potential)[t] < 0.0 ? 1 : 0;
    Candidate spread = judge.judged(std::move(negative));
    least = std::min(least, spread.cost());
    for (std::size_t i = 0; i < kAngles.size(); ++i) {
        if (walks[i].parted < kLeastParted || walks[i].cost() > least + kTolerance) continue;
        return chosen(std::move(walks[i]), InteriorSource::kWalk, kAngles[i]);
    }
    if (spread.parted >= kLeastParted) return chosen(std::move(spread), InteriorSource::kPotential, 0.0);
    return thickened(points, tetrahedra, scales);
}

}  // namespace shapedb
