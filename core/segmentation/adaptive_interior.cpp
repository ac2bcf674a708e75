#include "core/segmentation/adaptive_interior.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <queue>
#include <utility>

#include "core/base/math.h"
#include "core/base/parallel.h"
#include "core/base/return_if_error.h"
#include "core/geometry/tetrahedron.h"
#include "core/segmentation/bottleneck_angle.h"
#include "core/segmentation/inside_potential.h"

namespace shapedb {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Degrees: walks at all angles between the least and the largest are compared. Another angle than the
// preferred one costs kAngleWeight times the logarithm of their ratio more.
constexpr double kPreferredAngle = 22.0;
constexpr double kLeastAngle = 12.0;
constexpr double kLargestAngle = 36.0;
constexpr double kAngleWeight = 1.0;

// A facet is a bridge when its circumradius exceeds this many times the mean spacing of its corners.
constexpr double kBridge = 3.0;

// The cost of an interior is the fraction of points it leaves on one side, plus this times the area it
// bridges (in units of the area that all points stand for). Below one, because an interior that leaks
// through a hole loses all points, while one that closes the hole pays for the hole's area only.
constexpr double kBridgeWeight = 0.5;

// The potential is taken when it costs less than a walk by more than this: in a noisy scan some points stay
// within a layer, on one side of any boundary.
constexpr double kTolerance = 0.2;

// An interior that separates a smaller fraction of the points than this has leaked out.
constexpr double kLeastSeparated = 0.35;

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

// Per tetrahedron of an interior the width, in spacings, of the narrowest facet on the widest way to it from
// outside: peeling through facets wider than w takes exactly those above w. Minus infinity elsewhere.
std::vector<double> widestWays(const PointCloud& points, const Tetrahedra& tetrahedra,
                               const std::vector<double>& spacings, const std::vector<std::uint8_t>& inside) {
    std::vector<double> widest(tetrahedra.size(), -kInfinity);
    std::priority_queue<std::pair<double, std::uint32_t>> queue;
    const auto offer = [&](std::uint32_t t, double width) {
        if (width <= widest[t]) return;
        widest[t] = width;
        queue.push({width, t});
    };
    const auto widthOf = [&](std::uint32_t t, std::size_t facet) {
        return extentOf(points, tetrahedra.vertices[t], facet, spacings).width;
    };
    for (std::uint32_t t = 0; t < tetrahedra.size(); ++t) {
        for (std::size_t facet = 0; inside[t] != 0 && facet < 4; ++facet) {
            const std::uint32_t next = tetrahedra.neighbours[t][facet];
            if (next == kNoTetrahedron || inside[next] == 0) offer(t, widthOf(t, facet));
        }
    }
    while (!queue.empty()) {
        const auto [width, t] = queue.top();
        queue.pop();
        if (width < widest[t]) continue;
        for (std::size_t facet = 0; facet < 4; ++facet) {
            const std::uint32_t next = tetrahedra.neighbours[t][facet];
            if (next == kNoTetrahedron || inside[next] == 0) continue;
            offer(next, std::min(width, widthOf(t, facet)));
        }
    }
    return widest;
}

struct Candidate {
    std::vector<std::uint8_t> inside;
    double separatedFraction = 0.0;  // of the points: those with the boundary between their two poles
    double bridged = 0.0;            // area of bridges over the area that the points stand for
    double covered = 0.0;            // fraction of the boundary's area that is not a bridge

    double cost() const { return kBridgeWeight * bridged + 1.0 - separatedFraction; }
};

// Interiors {t : level[t] >= threshold} for all thresholds in [low, high].
struct Family {
    std::vector<double> level;  // minus infinity: never inside
    double low = 0.0;
    double high = 0.0;
    double preferred = 0.0;         // of equally good thresholds the nearest to this is taken
    double preferenceWeight = 0.0;  // what |log(threshold / preferred)| adds to the cost
};

struct Threshold {
    double value = 0.0;
    double cost = kInfinity;  // with the preference; infinite: none separates enough points
};

std::vector<std::uint8_t> interiorAt(const std::vector<double>& level, double threshold) {
    std::vector<std::uint8_t> inside(level.size());
    for (std::size_t t = 0; t < level.size(); ++t) inside[t] = level[t] >= threshold ? 1 : 0;
    return inside;
}

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

    // The threshold that costs least. A facet lies on the boundary, and a point is separated, for the
    // thresholds between the levels of its two tetrahedra: one pass over these ends gives all costs.
    Threshold best(const Family& family) const {
        const std::vector<Change> changes = changesOf(family.level);
        double bridged = 0.0;
        std::int64_t separated = 0;
        Threshold best;
        for (std::size_t i = 0; i < changes.size();) {
            const double from = changes[i].level;
            for (; i < changes.size() && changes[i].level == from; ++i) {
                bridged += changes[i].bridged;
                separated += changes[i].separated;
            }
            const double to = i < changes.size() ? changes[i].level : kInfinity;
            const double fraction = static_cast<double>(separated) / static_cast<double>(poles_.size());
            if (to < family.low || from >= family.high || fraction < kLeastSeparated) continue;
            const double first = std::max(std::nextafter(from, kInfinity), family.low);
            const double value =
                std::clamp(family.preferred, first, std::max(first, std::min(to, family.high)));
            double cost = kBridgeWeight * bridged + 1.0 - fraction;
            if (family.preferenceWeight > 0.0) {
                cost += family.preferenceWeight * std::abs(std::log(value / family.preferred));
            }
            if (cost < best.cost) best = {value, cost};
        }
        return best;
    }

    const std::vector<Poles>& poles() const { return poles_; }

  private:
    // What changes above a level.
    struct Change {
        double level = 0.0;
        double bridged = 0.0;
        int separated = 0;  // points
    };

    std::vector<Change> changesOf(const std::vector<double>& level) const {
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
        std::sort(changes.begin(), changes.end(),
                  [](const Change& a, const Change& b) { return a.level < b.level; });
        return changes;
    }

    std::vector<Facet> facets_;
    std::vector<Poles> poles_;
    double pointArea_ = 0.0;
};

// What walks leave, by the angle in degrees.
Family walks(const std::vector<std::uint8_t>& big, const std::vector<double>& bottlenecks) {
    Family family;
    family.level.resize(big.size());
    for (std::size_t t = 0; t < big.size(); ++t) {
        family.level[t] = big[t] != 0 ? bottlenecks[t] / kRadiansPerDegree : -kInfinity;
    }
    family.low = kLeastAngle;
    family.high = kLargestAngle;
    family.preferred = kPreferredAngle;
    family.preferenceWeight = kAngleWeight;
    return family;
}

// The width down to which peeling leaves enough of the volume.
double leastWidthFor(const PointCloud& points, const Tetrahedra& tetrahedra,
                     const std::vector<std::uint8_t>& inside, const std::vector<double>& widest) {
    std::vector<std::uint32_t> order;
    for (std::uint32_t t = 0; t < widest.size(); ++t) {
        if (inside[t] != 0) order.push_back(t);
    }
    std::sort(order.begin(), order.end(),
              [&](std::uint32_t a, std::uint32_t b) { return widest[a] < widest[b]; });
    const double enough = kBodyShare * volumeOf(points, tetrahedra, inside);
    double sum = 0.0;
    for (const std::uint32_t t : order) {
        sum += signedVolume(cornersOf(points, tetrahedra.vertices[t]));
        if (sum >= enough) return widest[t];
    }
    return kInfinity;
}

// The candidate, or what peeling leaves of it if that costs less.
Candidate withoutWebs(const PointCloud& points, const Tetrahedra& tetrahedra,
                      const std::vector<double>& spacings, const InteriorEvaluator& evaluator,
                      double leastWidth, Candidate candidate) {
    if (candidate.bridged <= kWorthPeeling) return candidate;
    const std::vector<double> widest = widestWays(points, tetrahedra, spacings, candidate.inside);
    Family family;
    family.level.resize(widest.size());
    for (std::size_t t = 0; t < widest.size(); ++t) {
        family.level[t] = candidate.inside[t] != 0 ? -widest[t] : -kInfinity;
    }
    family.low = std::numeric_limits<double>::lowest();
    family.high = -std::max(leastWidth, leastWidthFor(points, tetrahedra, candidate.inside, widest));
    family.preferred = -kInfinity;
    const Threshold best = evaluator.best(family);
    if (best.cost >= candidate.cost()) return candidate;
    return evaluator.evaluate(interiorAt(family.level, best.value));
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
    const Family family = walks(big, *bottlenecks);
    const Threshold angle = evaluator.best(family);
    const auto walk = [&] {
        Candidate candidate = evaluator.evaluate(interiorAt(family.level, angle.value));
        return chosen(trimmed(std::move(candidate), kLeastWalkPeel), InteriorSource::kWalk, angle.value);
    };
    // Costs are not negative, so the potential cannot be clearly better.
    if (angle.cost <= kTolerance) return walk();
    const auto potential = insidePotential(points, tetrahedra, evaluator.poles(), context);
    RETURN_IF_ERROR(potential);
    std::vector<std::uint8_t> negative(potential->size());
    for (std::size_t t = 0; t < negative.size(); ++t) negative[t] = (*potential)[t] < 0.0 ? 1 : 0;
    Candidate spread = evaluator.evaluate(std::move(negative));
    if (angle.cost <= spread.cost() + kTolerance) return walk();
    if (spread.separatedFraction >= kLeastSeparated) {
        return chosen(trimmed(std::move(spread), kLeastPeel), InteriorSource::kPotential, 0.0);
    }
    return thickened(points, tetrahedra, spacings);
}

}  // namespace shapedb
