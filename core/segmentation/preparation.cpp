#include "core/segmentation/preparation.h"

#include <algorithm>
#include <optional>
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

// What is prepared so far, and who lies near whom there, looked for once while the sites stay.
struct Preparation {
    PreparedPoints prepared;
    std::optional<NeighbourIndex> index;

    const NeighbourIndex& neighbours() {
        if (!index) index.emplace(prepared.sites);
        return *index;
    }

    // `siteOfSite`: where the sites went.
    void replaceSites(PointCloud sites, const std::vector<std::uint32_t>& siteOfSite) {
        follow(prepared.siteOfPoint, siteOfSite);
        if (sites == prepared.sites) return;
        index.reset();
        prepared.sites = std::move(sites);
    }
};

Result<void> leaveOutStrays(Preparation& work, double ratio, const RunContext& context) {
    const PointCloud& sites = work.prepared.sites;
    const auto stray = findStrays(sites, work.neighbours(), ratio, context);
    if (!stray) return fail(stray.error());
    std::vector<std::uint32_t> rank(sites.size(), kNoSite);
    PointCloud kept;
    for (std::size_t i = 0; i < sites.size(); ++i) {
        if ((*stray)[i]) continue;
        rank[i] = static_cast<std::uint32_t>(kept.size());
        kept.push_back(sites[i]);
    }
    work.replaceSites(std::move(kept), rank);
    return {};
}

Result<void> smoothNoise(Preparation& work, double reach, const RunContext& context) {
    const PointCloud& sites = work.prepared.sites;
    work.prepared.noise = estimateNoise(sites, work.neighbours());
    auto moved = smooth(sites, work.neighbours(), work.prepared.noise, reach, context);
    if (!moved) return fail(moved.error());
    MergedPoints merged = mergeDuplicates(*moved);
    work.replaceSites(std::move(merged.points), merged.siteOfPoint);
    return {};
}

Result<void> evenOut(Preparation& work, double multiple, const RunContext& context) {
    const NoiseEstimate& noise = work.prepared.noise;
    const double spacing = multiple * std::max(noise.spacing, kSpacingPerSigma * noise.sigma);
    auto thinned = thin(work.prepared.sites, work.neighbours(), spacing, context);
    if (!thinned) return fail(thinned.error());
    work.replaceSites(std::move(thinned->points), thinned->siteOfPoint);
    work.prepared.spacing = spacing;
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
    Preparation work{std::move(*begun), std::nullopt};
    if (options.strayRatio > 0.0) {
        if (auto go = begin("strays"); !go) return fail(go.error());
        if (auto done = leaveOutStrays(work, options.strayRatio, context); !done) return fail(done.error());
    }
    if (options.smoothingReach > 0.0) {
        if (auto go = begin("smooth"); !go) return fail(go.error());
        if (auto done = smoothNoise(work, options.smoothingReach, context); !done) return fail(done.error());
        if (options.strayRatio > 0.0) {
            const double ratio = std::min(options.strayRatio, kStragglerRatio);
            if (auto done = leaveOutStrays(work, ratio, context); !done) return fail(done.error());
        }
    }
    if (options.evenSpacing > 0.0) {
        if (auto go = begin("even_spacing"); !go) return fail(go.error());
        if (auto done = evenOut(work, options.evenSpacing, context); !done) return fail(done.error());
    }
    PreparedPoints& prepared = work.prepared;
    prepared.strays = static_cast<std::uint64_t>(
        std::count(prepared.siteOfPoint.begin(), prepared.siteOfPoint.end(), kNoSite));
    if (prepared.sites.size() < 4) {
        return fail(ErrorCode::kTooFewPoints, "fewer than 4 points are left without strays");
    }
    return std::move(work.prepared);
}

}  // namespace shapedb
