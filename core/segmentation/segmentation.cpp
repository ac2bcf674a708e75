// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/segmentation/segmentation.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <exception>
#include <new>
#include <numeric>
#include <string>
#include <utility>

#include "core/base/double2.h"
#include "core/base/math.h"
#include "core/base/return_if_error.h"
#include "core/delaunay/hilbert_order.h"
#include "core/geometry/bounding.h"
#include "core/geometry/neighbours.h"
#include "core/geometry/tetrahedron.h"
#include "core/preparation/prepare_points.h"
#include "core/segmentation/contrast_merging.h"
#include "core/segmentation/flow.h"
#include "core/segmentation/interior.h"
#include "core/segmentation/segments.h"

namespace shapedb {

namespace {

// A larger share of outliers makes the interior less certain: what was left out may be part of the shape.
constexpr double kOrdinaryOutliers = 0.05;

// Share of the ball of its maximum that a light segment must fill.
constexpr double kLeastFilling = 0.01;

// Above it there is no surface: a ball or a cube filled with points has 0.80 and more, scans without much
// noise 0.53 at most.
constexpr double kNoSurfaceFlatness = 0.78;
constexpr double kMostQualityWithoutSurface = 0.1;
constexpr double kMostQualityOfThinWalls = 0.4;

// So many points show the parts of a shape and the mouths of its hollows: where the boundary alone looks
// certain, 43 of 45 synthetic scans of 1,000 points have about the right volume, 20 of 40 of 200, 4 of 44 of
// 50.
constexpr double kEnoughPoints = 1000.0;

using Clock = std::chrono::steady_clock;

double secondsSince(Clock::time_point start) {
    return std::chrono::duration<double>(Clock::now() - start).count();
}

// Announces and times the stages; each may be cancelled as it begins.
class StageClock {
  public:
    StageClock(const RunContext& context, std::vector<StageTime>& stages)
        : context_(context), stages_(stages), start_(Clock::now()) {}

    Result<void> begin(const char* stage) {
        end();
        context_.report(stage, 0, 0);
        stages_.push_back({stage, 0.0});
        begun_ = Clock::now();
        return context_.checkpoint();
    }
    void end() {
        // A stage that has ended keeps its time.
        if (!stages_.empty() && stages_.back().seconds == 0.0) stages_.back().seconds = secondsSince(begun_);
    }
    double lastSeconds() const { return stages_.back().seconds; }
    double totalSeconds() const { return secondsSince(start_); }

  private:
    const RunContext& context_;
    std::vector<StageTime>& stages_;
    Clock::time_point start_;
    Clock::time_point begun_;
};

// Volume and first and second moments of a segment, summed over its tetrahedra about the origin of the unit
// frame.
struct Moments {
    double volume = 0.0;
    Point3 first;
    std::array<Double2, 3> second = {0.0, 0.0, 0.0};  // xx, xy, xz, yy, yz, zz

    void add(const TetrahedronCorners& p) {
        // Rounding may give a flat tetrahedron a negative volume.
        const double v = std::max(0.0, signedVolume(p));
        const Point3 sum = p[0] + p[1] + p[2] + p[3];
        volume += v;
        first = first + (0.25 * v) * sum;
        // Integral of x y over a tetrahedron: v / 20 * (sum_i x_i y_i + sum_i x_i * sum_i y_i).
        const std::array<Products, 5> terms = {products(sum), products(p[0]), products(p[1]), products(p[2]),
                                               products(p[3])};
        for (std::size_t i = 0; i < second.size(); ++i) {
            second[i] = second[i] + Double2(v / 20.0) *
                                        (terms[0][i] + terms[1][i] + terms[2][i] + terms[3][i] + terms[4][i]);
        }
    }

    std::array<double, 6> secondMoments() const {
        return {second[0].low(),  second[0].high(), second[1].low(),
                second[1].high(), second[2].low(),  second[2].high()};
    }

  private:
    using Products = std::array<Double2, 3>;
    static Products products(const Point3& p) {
        return {Double2(p.x, p.x) * Double2(p.x, p.y), Double2(p.x, p.y) * Double2(p.z, p.y),
                Double2(p.y, p.z) * Double2(p.z, p.z)};
    }
};

double ballVolume(double radius) { return 4.0 / 3.0 * kPi * radius * radius * radius; }

/// A light segment that hardly fills the ball of its maximum: flat tetrahedra near the surface, whose
/// circumspheres reach far out of the shape.
bool isSliver(double volume, double radius, double totalVolume, double minShare) {
    return volume < minShare * totalVolume && volume < kLeastFilling * ballVolume(radius);
}

// `mostRadius`: of a ball with the volume of the whole shape, unit frame.
Segment toSegment(const Moments& m, std::uint32_t maximum, const Tetrahedra& tetrahedra, double mostRadius,
                  const Frame& frame) {
    Segment segment;
    const double unit2 = frame.unit * frame.unit;
    const Point3 mean = (1.0 / m.volume) * m.first;
    segment.volume = m.volume * unit2 * frame.unit;
    segment.centroid = frame.toScan(mean);
    // The Delaunay ball of a flat tetrahedron may reach far out of the shape; one inside it cannot.
    const double radius = tetrahedra.circumradii[maximum];
    segment.maximumRadius = std::min(radius, mostRadius) * frame.unit;
    segment.maximum =
        radius <= mostRadius ? frame.toScan(tetrahedra.circumcentres[maximum]) : segment.centroid;
    const std::array<double, 6> square = {mean.x * mean.x, mean.x * mean.y, mean.x * mean.z,
                                          mean.y * mean.y, mean.y * mean.z, mean.z * mean.z};
    const std::array<double, 6> second = m.secondMoments();
    for (std::size_t i = 0; i < 6; ++i) segment.covariance[i] = (second[i] / m.volume - square[i]) * unit2;
    return segment;
}

// Fills result.segments, by falling volume, and result.tetrahedronSegment to match. The tetrahedra of slivers
// join the segment whose centroid is nearest, without changing what is said of it; segments whose tetrahedra
// are all flat to the last digit are left out. `sliverShare` as minShare of isSliver.
void describeSegments(const PointCloud& points, SegmentLabels labels, const Frame& frame, double sliverShare,
                      Segmentation& result) {
    std::vector<Moments> moments(labels.maxima.size());
    for (std::size_t t = 0; t < result.tetrahedra.size(); ++t) {
        const std::int32_t segment = labels.ofTetrahedron[t];
        if (segment < 0) continue;
        moments[static_cast<std::size_t>(segment)].add(cornersOf(points, result.tetrahedra.vertices[t]));
        ++result.interiorTetrahedra;
    }
    double total = 0.0;
    for (const Moments& m : moments) total += m.volume;
    const double mostRadius = std::cbrt(total / ballVolume(1.0));
    std::vector<std::uint32_t> order;
    std::vector<std::uint32_t> slivers;
    for (std::uint32_t s = 0; s < moments.size(); ++s) {
        if (!(moments[s].volume > 0.0)) continue;
        const double radius = result.tetrahedra.circumradii[labels.maxima[s]];
        (isSliver(moments[s].volume, radius, total, sliverShare) ? slivers : order).push_back(s);
    }
    std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) {
        if (moments[a].volume != moments[b].volume) return moments[a].volume > moments[b].volume;
        return lexicographicLess(moments[a].first, moments[b].first);
    });
    // Tetrahedra of segments without volume end up in none.
    std::vector<std::int32_t> rank(moments.size(), -1);
    for (std::size_t i = 0; i < order.size(); ++i) {
        const std::uint32_t s = order[i];
        rank[s] = static_cast<std::int32_t>(i);
        result.segments.push_back(
            toSegment(moments[s], labels.maxima[s], result.tetrahedra, mostRadius, frame));
        result.volume += result.segments.back().volume;
    }
    for (const std::uint32_t s : slivers) {
        const Point3 centroid = frame.toScan((1.0 / moments[s].volume) * moments[s].first);
        const auto nearest = std::min_element(
            result.segments.begin(), result.segments.end(), [&](const Segment& x, const Segment& y) {
                return squaredDistance(x.centroid, centroid) < squaredDistance(y.centroid, centroid);
            });
        if (nearest != result.segments.end()) {
            rank[s] = static_cast<std::int32_t>(nearest - result.segments.begin());
        }
    }
    result.tetrahedronSegment = std::move(labels.ofTetrahedron);
    for (std::int32_t& segment : result.tetrahedronSegment) {
        if (segment >= 0) segment = rank[static_cast<std::size_t>(segment)];
    }
}

// Segment of each site: that of the tetrahedron at it with the largest ball, of those in a segment.
std::vector<std::int32_t> labelSites(std::size_t siteCount, const Segmentation& result) {
    std::vector<std::int32_t> labels(siteCount, -1);
    std::vector<double> largest(siteCount, -1.0);
    for (std::size_t t = 0; t < result.tetrahedra.size(); ++t) {
        if (result.tetrahedronSegment[t] < 0) continue;
        for (const std::uint32_t v : result.tetrahedra.vertices[t]) {
            if (result.tetrahedra.circumradii[t] <= largest[v]) continue;
            largest[v] = result.tetrahedra.circumradii[t];
            labels[v] = result.tetrahedronSegment[t];
        }
    }
    return labels;
}

// Per site 1 when it lies on the convex hull.
std::vector<std::uint8_t> onHull(std::size_t siteCount, const Tetrahedra& tetrahedra) {
    std::vector<std::uint8_t> on(siteCount, 0);
    for (std::size_t t = 0; t < tetrahedra.size(); ++t) {
        for (std::size_t facet = 0; facet < 4; ++facet) {
            if (tetrahedra.neighbours[t][facet] != kNoTetrahedron) continue;
            for (std::size_t k = 1; k < 4; ++k) on[tetrahedra.vertices[t][(facet + k) % 4]] = 1;
        }
    }
    return on;
}

// Size of the interior, in the unit of the sites. When it touches every site on the hull, these suffice: they
// have the same hull as all of them, so the same boxes hold them.
Result<double> interiorSize(const PointCloud& sites, const std::vector<std::int32_t>& siteLabels,
                            const Tetrahedra& tetrahedra, const RunContext& context) {
    const std::vector<std::uint8_t> on = onHull(sites.size(), tetrahedra);
    bool hullTouched = true;
    for (std::size_t i = 0; i < sites.size(); ++i)
        hullTouched = hullTouched && (!on[i] || siteLabels[i] >= 0);
    PointCloud touched;
    for (std::size_t i = 0; i < sites.size(); ++i) {
        if (siteLabels[i] >= 0 && (on[i] || !hullTouched)) touched.push_back(sites[i]);
    }
    return smallestBoxDiagonal(touched, context);
}

void toScanUnits(const Frame& frame, PointCloud sites, Segmentation& result) {
    for (Point3& p : sites) p = frame.toScan(p);
    result.sites = std::move(sites);
    for (Point3& c : result.tetrahedra.circumcentres) c = frame.toScan(c);
    for (double& r : result.tetrahedra.circumradii) r *= frame.unit;
}

// How fine the spacing would have to be, over what it is: at most 1. Thinning does not count: it leaves out
// what noise makes worthless, not what the scan shows.
double shareResolved(const PreparedPoints& prepared) {
    return std::min(1.0, std::sqrt(static_cast<double>(prepared.distinct) / kEnoughPoints));
}

InteriorDoubt doubtOf(const PreparedPoints& prepared) {
    if (prepared.noise.flatness > kNoSurfaceFlatness) return InteriorDoubt::kNoSurface;
    if (prepared.noise.layered) return InteriorDoubt::kThinWalls;
    return shareResolved(prepared) < 1.0 ? InteriorDoubt::kFewPoints : InteriorDoubt::kNone;
}

double mostQuality(InteriorDoubt doubt) {
    switch (doubt) {
        case InteriorDoubt::kNone:
        case InteriorDoubt::kFewPoints: return 1.0;
        case InteriorDoubt::kNoSurface: return kMostQualityWithoutSurface;
        case InteriorDoubt::kThinWalls: return kMostQualityOfThinWalls;
    }
    return 1.0;
}

Result<PreparedPoints> prepare(const PointCloud& points, const SegmentationOptions& options,
                               const RunContext& context, StageClock& clock, Segmentation& result) {
    auto prepared = preparePoints(points, options.preparation, context,
                                  [&](const char* stage) { return clock.begin(stage); });
    RETURN_IF_ERROR(prepared);
    result.duplicates = prepared->duplicates;
    result.outliers = prepared->outliers;
    result.outlierClusters = prepared->outlierClusters;
    result.noise = prepared->noise.sigma * prepared->frame.unit;
    if (options.interiorMethod == InteriorMethod::kAdaptive) result.doubt = doubtOf(*prepared);
    result.siteOfPoint = std::move(prepared->siteOfPoint);
    return prepared;
}

// Puts neighbours in space next to each other in memory, for the sake of all later stages.
HilbertSortedCloud sortSites(const PointCloud& sites, std::vector<std::uint32_t>& siteOfPoint) {
    HilbertSortedCloud sorted(sites);
    std::vector<std::uint32_t> rank(sites.size());
    for (std::uint32_t i = 0; i < rank.size(); ++i) rank[sorted.order()[i]] = i;
    for (std::uint32_t& site : siteOfPoint) {
        if (site != kNoSite) site = rank[site];
    }
    return sorted;
}

// 1 while few points were left out, 0 when all were.
double shareTrusted(const Segmentation& result) {
    const double share =
        static_cast<double>(result.outliers) / static_cast<double>(result.siteOfPoint.size());
    return 1.0 - std::max(0.0, share - kOrdinaryOutliers) / (1.0 - kOrdinaryOutliers);
}

// Per tetrahedron 1 when it is interior; records in the result how it was found.
Result<std::vector<std::uint8_t>> findInterior(const PreparedPoints& prepared,
                                               const std::vector<std::uint8_t>& big,
                                               const std::vector<double>& spacings,
                                               const SegmentationOptions& options, const RunContext& context,
                                               Segmentation& result) {
    if (options.interiorMethod == InteriorMethod::kWalk) {
        result.angleDegrees = options.deepAngleDegrees;
        return interiorTetrahedra(prepared.sites, result.tetrahedra, big, options, context);
    }
    auto interior = adaptiveInterior(prepared.sites, result.tetrahedra, big, spacings, context);
    RETURN_IF_ERROR(interior);
    result.interiorSource = interior->source;
    result.angleDegrees = interior->angleDegrees;
    result.quality = shareResolved(prepared) *
                     std::min(interior->quality * shareTrusted(result), mostQuality(result.doubt));
    return std::move(interior->inside);
}

Result<SegmentLabels> findSegments(const PreparedPoints& prepared, const SegmentationOptions& options,
                                   const RunContext& context, StageClock& clock, Segmentation& result) {
    const PointCloud& sites = prepared.sites;
    const Tetrahedra& tetrahedra = result.tetrahedra;
    RETURN_IF_ERROR(clock.begin("point_scale"));
    const auto spacings = localSpacings(sites, context);
    RETURN_IF_ERROR(spacings);
    RETURN_IF_ERROR(clock.begin("interior"));
    const std::vector<std::uint8_t> big = bigBalls(tetrahedra, *spacings, options.bigBallRatio);
    result.bigBalls = static_cast<std::uint64_t>(std::count(big.begin(), big.end(), 1));
    const auto interior = findInterior(prepared, big, *spacings, options, context, result);
    RETURN_IF_ERROR(interior);
    RETURN_IF_ERROR(clock.begin("flow"));
    const auto flow = flowMasks(sites, tetrahedra, *interior, context);
    RETURN_IF_ERROR(flow);
    RETURN_IF_ERROR(clock.begin("segments"));
    auto fine = stableManifolds(tetrahedra, *interior, *flow, context);
    RETURN_IF_ERROR(fine);
    result.maxima = fine->maxima.size();
    RETURN_IF_ERROR(clock.begin("merge"));
    if (options.mergeContrast == 0.0) {
        return mergeSegments(sites, tetrahedra, std::move(*fine), options.mergeRatio);
    }
    return mergeSegmentsByContrast(sites, tetrahedra, *flow, *fine,
                                   {options.mergeContrast, options.minSegmentShare, options.maxSegments},
                                   context);
}

Result<Segmentation> segmentOrThrow(const PointCloud& points, const SegmentationOptions& options,
                                    const RunContext& context) {
    Segmentation result;
    StageClock clock(context, result.stages);
    auto prepared = prepare(points, options, context, clock, result);
    RETURN_IF_ERROR(prepared);
    RETURN_IF_ERROR(clock.begin("delaunay"));
    HilbertSortedCloud sorted = sortSites(prepared->sites, result.siteOfPoint);
    prepared->sites = PointCloud();  // their memory is wanted meanwhile
    auto tetrahedra = triangulate(sorted, context);
    prepared->sites = std::move(sorted).takePoints();
    RETURN_IF_ERROR(tetrahedra);
    result.tetrahedra = std::move(*tetrahedra);
    clock.end();
    result.delaunaySeconds = clock.lastSeconds();
    auto labels = findSegments(*prepared, options, context, clock, result);
    RETURN_IF_ERROR(labels);
    RETURN_IF_ERROR(clock.begin("describe"));
    // The published method merges by a criterion of its own and keeps whatever is left.
    const double sliverShare = options.mergeContrast > 0.0 ? options.minSegmentShare : 0.0;
    describeSegments(prepared->sites, std::move(*labels), prepared->frame, sliverShare, result);
    if (result.segments.empty()) {
        return fail(ErrorCode::kNoInterior,
                    "no closed interior: the surface is open, too noisy or too thin for its sampling (" +
                        std::to_string(prepared->sites.size()) + " distinct points, " +
                        std::to_string(result.bigBalls) +
                        " big Delaunay balls, all reached from outside); "
                        "scan the shape from all sides or raise big_ball_ratio");
    }
    RETURN_IF_ERROR(context.checkpoint());
    const std::vector<std::int32_t> siteLabels = labelSites(prepared->sites.size(), result);
    const auto size = interiorSize(prepared->sites, siteLabels, result.tetrahedra, context);
    RETURN_IF_ERROR(size);
    result.size = *size * prepared->frame.unit;
    RETURN_IF_ERROR(context.checkpoint());
    result.pointSegment.reserve(points.size());
    for (const std::uint32_t site : result.siteOfPoint) {
        result.pointSegment.push_back(site == kNoSite ? -1 : siteLabels[site]);
    }
    // All of the above is in the unit frame.
    toScanUnits(prepared->frame, std::move(prepared->sites), result);
    clock.end();
    result.totalSeconds = clock.totalSeconds();
    return result;
}

}  // namespace

Result<Segmentation> segment(const PointCloud& points, const SegmentationOptions& options,
                             const RunContext& context) {
    RETURN_IF_ERROR(validate(options));
    try {
        return segmentOrThrow(points, options, context);
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::kOutOfMemory,
                    "not enough memory to segment " + std::to_string(points.size()) + " points");
    } catch (const std::exception& e) {
        return fail(ErrorCode::kInternal, std::string("segmentation: ") + e.what());
    }
}

}  // namespace shapedb
