#include "core/segmentation/preparation.h"

#include <algorithm>
#include <utility>

#include "core/geometry/decimate.h"
#include "core/geometry/neighbours.h"
#include "core/geometry/outliers.h"
#include "core/geometry/scan_grid.h"
#include "core/geometry/thin.h"

namespace shapedb {

namespace {

// Points closer together than the noise say nothing new about the surface.
constexpr double kSpacingPerSigma = 1.0;

// What smoothing leaves behind away from the surface is sparser than its surroundings by less
// than a stray of the raw scan.
constexpr double kStragglerRatio = 1.7;

// Scans of more than this many times the target are not sorted before they are decimated.
constexpr std::size_t kStreamingRatio = 4;

// Composes siteOfPoint with a further step.
void follow(std::vector<std::uint32_t>& siteOfPoint, const std::vector<std::uint32_t>& step) {
    for (std::uint32_t& site : siteOfPoint) {
        if (site != kNoSite) site = step[site];
    }
}

Result<void> leaveOutStrays(PreparedPoints& prepared, double ratio, const RunContext& context) {
    const NeighbourIndex index(prepared.sites);
    const auto stray = findStrays(prepared.sites, index, ratio, context);
    if (!stray) return fail(stray.error());
    std::vector<std::uint32_t> rank(prepared.sites.size(), kNoSite);
    PointCloud kept;
    for (std::size_t i = 0; i < prepared.sites.size(); ++i) {
        if ((*stray)[i]) continue;
        rank[i] = static_cast<std::uint32_t>(kept.size());
        kept.push_back(prepared.sites[i]);
    }
    follow(prepared.siteOfPoint, rank);
    prepared.sites = std::move(kept);
    return {};
}

Result<void> smoothNoise(PreparedPoints& prepared, double reach, const RunContext& context) {
    const NeighbourIndex index(prepared.sites);
    prepared.noise = estimateNoise(prepared.sites, index);
    auto moved = smooth(prepared.sites, index, prepared.noise, reach, context);
    if (!moved) return fail(moved.error());
    MergedPoints merged = mergeDuplicates(*moved);
    follow(prepared.siteOfPoint, merged.siteOfPoint);
    prepared.sites = std::move(merged.points);
    return {};
}

Result<void> evenOut(PreparedPoints& prepared, double multiple, const RunContext& context) {
    const double spacing =
        multiple * std::max(prepared.noise.spacing, kSpacingPerSigma * prepared.noise.sigma);
    const NeighbourIndex index(prepared.sites);
    auto thinned = thin(prepared.sites, index, spacing, context);
    if (!thinned) return fail(thinned.error());
    follow(prepared.siteOfPoint, thinned->siteOfPoint);
    prepared.sites = std::move(thinned->points);
    prepared.spacing = spacing;
    return {};
}

// Sanitised and decimated. Large scans go through a grid instead of being sorted first.
Result<PreparedPoints> fewPoints(const PointCloud& points, std::size_t target, const RunContext& context,
                                 const std::function<Result<void>(const char*)>& begin) {
    PreparedPoints prepared;
    if (target != 0 && points.size() > kStreamingRatio * target) {
        if (auto go = begin("decimate"); !go) return fail(go.error());
        auto gridded = gridScan(points, target, context);
        if (!gridded) return fail(gridded.error());
        if (*gridded) {
            prepared.sites = std::move((*gridded)->points);
            prepared.frame = (*gridded)->frame;
            prepared.siteOfPoint = std::move((*gridded)->siteOfPoint);
            return prepared;
        }
    }
    auto clean = sanitise(points);
    if (!clean) return fail(clean.error());
    prepared.sites = std::move(clean->points);
    prepared.frame = clean->frame;
    prepared.siteOfPoint = std::move(clean->siteOfPoint);
    prepared.duplicates = clean->duplicates;
    if (target == 0 || prepared.sites.size() <= target) return prepared;
    if (auto go = begin("decimate"); !go) return fail(go.error());
    auto thinned = decimate(prepared.sites, target, context);
    if (!thinned) return fail(thinned.error());
    follow(prepared.siteOfPoint, thinned->siteOfPoint);
    prepared.sites = std::move(thinned->points);
    return prepared;
}

}  // namespace

Result<PreparedPoints> preparePoints(const PointCloud& points, const SegmentationOptions& options,
                                     const RunContext& context,
                                     const std::function<Result<void>(const char*)>& begin) {
    if (auto go = begin("sanitise"); !go) return fail(go.error());
    auto begun = fewPoints(points, options.decimateTo, context, begin);
    if (!begun) return begun;
    PreparedPoints prepared = std::move(*begun);
    if (options.strayRatio > 0.0) {
        if (auto go = begin("strays"); !go) return fail(go.error());
        if (auto done = leaveOutStrays(prepared, options.strayRatio, context); !done)
            return fail(done.error());
    }
    if (options.smoothingReach > 0.0) {
        if (auto go = begin("smooth"); !go) return fail(go.error());
        if (auto done = smoothNoise(prepared, options.smoothingReach, context); !done)
            return fail(done.error());
        if (options.strayRatio > 0.0) {
            const double ratio = std::min(options.strayRatio, kStragglerRatio);
            if (auto done = leaveOutStrays(prepared, ratio, context); !done) return fail(done.error());
        }
    }
    if (options.evenSpacing > 0.0) {
        if (auto go = begin("even_spacing"); !go) return fail(go.error());
        if (auto done = evenOut(prepared, options.evenSpacing, context); !done) return fail(done.error());
    }
    prepared.strays = static_cast<std::uint64_t>(
        std::count(prepared.siteOfPoint.begin(), prepared.siteOfPoint.end(), kNoSite));
    if (prepared.sites.size() < 4) {
        return fail(ErrorCode::kTooFewPoints, "fewer than 4 points are left without strays");
    }
    return prepared;
}

}  // namespace shapedb
