// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/preparation/prepare_points.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "core/base/range_check.h"
#include "core/base/return_if_error.h"
#include "core/geometry/merge_duplicates.h"
#include "core/geometry/neighbours.h"
#include "core/preparation/decimate.h"
#include "core/preparation/outliers.h"
#include "core/preparation/sanitise.h"
#include "core/preparation/scan_grid.h"
#include "core/preparation/thin.h"

namespace shapedb {

namespace {

// Points that smoothing could not bring back to the surface stand out less than outliers of the raw
// scan: by this ratio.
constexpr double kStragglerRatio = 1.7;

// Scans with more than this many times the target are decimated by gridScan, without being sorted.
constexpr std::size_t kStreamingRatio = 4;

// Composes siteOfPoint with one more step.
void follow(std::vector<std::uint32_t>& siteOfPoint, const std::vector<std::uint32_t>& step) {
    for (std::uint32_t& site : siteOfPoint) {
        if (site != kNoSite) site = step[site];
    }
}

// The points so far, with an index of them that is built once for as long as they stay the same.
struct Preparation {
    PreparedPoints prepared;
    std::optional<NeighbourIndex> index;
    std::size_t bodyPoints = SIZE_MAX;  // of a typical separate body, as far as known

    const NeighbourIndex& neighbours() {
        if (!index) index.emplace(prepared.sites);
        return *index;
    }

    // `siteOfSite`: old site -> new site.
    void replaceSites(PointCloud sites, const std::vector<std::uint32_t>& siteOfSite) {
        follow(prepared.siteOfPoint, siteOfSite);
        // The index still holds.
        if (sites == prepared.sites) return;
        index.reset();
        prepared.sites = std::move(sites);
    }
};

Result<void> leaveOutOutliers(Preparation& work, double ratio, const RunContext& context) {
    const PointCloud& sites = work.prepared.sites;
    const auto found = findOutliers(sites, work.neighbours(), ratio, context);
    RETURN_IF_ERROR(found);
    work.prepared.outlierClusters += found->clusters;
    work.bodyPoints = found->bodyPoints;
    std::vector<std::uint32_t> rank(sites.size(), kNoSite);
    PointCloud kept;
    for (std::size_t i = 0; i < sites.size(); ++i) {
        if (found->isOutlier[i]) continue;
        rank[i] = static_cast<std::uint32_t>(kept.size());
        kept.push_back(sites[i]);
    }
    work.replaceSites(std::move(kept), rank);
    return {};
}

Result<void> smoothNoise(Preparation& work, double reach, const RunContext& context) {
    const PointCloud& sites = work.prepared.sites;
    // Half of a single body shows little curvature; of many small ones even that is too much.
    const bool manyBodies = work.bodyPoints < sites.size() / 2;
    work.prepared.noise =
        estimateNoise(sites, work.neighbours(), manyBodies ? work.bodyPoints / 4 : sites.size() / 2);
    auto moved = smooth(sites, work.neighbours(), work.prepared.noise, reach, context);
    RETURN_IF_ERROR(moved);
    MergedPoints merged = mergeDuplicates(*moved);
    work.replaceSites(std::move(merged.points), merged.siteOfPoint);
    return {};
}

Result<void> thinOut(Preparation& work, double multiple, const RunContext& context) {
    const NoiseEstimate& noise = work.prepared.noise;
    // Points closer together than the noise add nothing about the surface.
    const double spacing = multiple * std::max(noise.spacing, noise.sigma);
    auto thinned = thin(work.prepared.sites, work.neighbours(), spacing, context);
    RETURN_IF_ERROR(thinned);
    work.replaceSites(std::move(thinned->points), thinned->siteOfPoint);
    work.prepared.spacing = spacing;
    return {};
}

// Sanitises and decimates.
Result<PreparedPoints> sanitiseAndDecimate(const PointCloud& points, std::size_t target,
                                           const RunContext& context,
                                           const std::function<Result<void>(const char*)>& begin) {
    PreparedPoints prepared;
    if (target != 0 && points.size() > kStreamingRatio * target) {
        RETURN_IF_ERROR(begin("decimate"));
        auto gridded = gridScan(points, target, context);
        RETURN_IF_ERROR(gridded);
        if (*gridded) {
            prepared.sites = std::move((*gridded)->points);
            prepared.frame = (*gridded)->frame;
            prepared.siteOfPoint = std::move((*gridded)->siteOfPoint);
            return prepared;
        }
    }
    // A small scan, or one with so many repeated points that gridScan declined.
    auto clean = sanitise(points);
    RETURN_IF_ERROR(clean);
    prepared.sites = std::move(clean->points);
    prepared.frame = clean->frame;
    prepared.siteOfPoint = std::move(clean->siteOfPoint);
    prepared.duplicates = clean->duplicates;
    if (target == 0 || prepared.sites.size() <= target) return prepared;
    RETURN_IF_ERROR(begin("decimate"));
    auto decimated = decimate(prepared.sites, target, context);
    RETURN_IF_ERROR(decimated);
    follow(prepared.siteOfPoint, decimated->siteOfPoint);
    prepared.sites = std::move(decimated->points);
    return prepared;
}

}  // namespace

Result<PreparedPoints> preparePoints(const PointCloud& points, const PreparationOptions& options,
                                     const RunContext& context,
                                     const std::function<Result<void>(const char*)>& begin) {
    RETURN_IF_ERROR(begin("sanitise"));
    auto begun = sanitiseAndDecimate(points, options.decimateTo, context, begin);
    RETURN_IF_ERROR(begun);
    Preparation work;
    work.prepared = std::move(*begun);
    if (options.outlierRatio > 0.0) {
        RETURN_IF_ERROR(begin("outliers"));
        RETURN_IF_ERROR(leaveOutOutliers(work, options.outlierRatio, context));
    }
    work.prepared.distinct = work.prepared.sites.size();
    if (options.smoothingReach > 0.0) {
        RETURN_IF_ERROR(begin("smooth"));
        RETURN_IF_ERROR(smoothNoise(work, options.smoothingReach, context));
        if (options.outlierRatio > 0.0) {
            const double ratio = std::min(options.outlierRatio, kStragglerRatio);
            RETURN_IF_ERROR(leaveOutOutliers(work, ratio, context));
        }
    }
    if (options.thinning > 0.0) {
        RETURN_IF_ERROR(begin("thin"));
        RETURN_IF_ERROR(thinOut(work, options.thinning, context));
    }
    PreparedPoints& prepared = work.prepared;
    prepared.outliers = static_cast<std::uint64_t>(
        std::count(prepared.siteOfPoint.begin(), prepared.siteOfPoint.end(), kNoSite));
    if (prepared.sites.size() < 4) {
        return fail(ErrorCode::kTooFewPoints, "fewer than 4 points are left after removing outliers");
    }
    return std::move(work.prepared);
}

Result<void> validate(const PreparationOptions& options) {
    RETURN_IF_ERROR(requireInRange(
        options.outlierRatio == 0.0 || (options.outlierRatio > 1.0 && std::isfinite(options.outlierRatio)),
        "outlier_ratio", options.outlierRatio, "0 (off) or above 1"));
    RETURN_IF_ERROR(requireInRange(
        options.smoothingReach == 0.0 || (options.smoothingReach >= 1.0 && options.smoothingReach <= 20.0),
        "smoothing_reach", options.smoothingReach, "0 (off) or from 1 to 20"));
    RETURN_IF_ERROR(requireInRange(options.thinning >= 0.0 && options.thinning <= 10.0, "thinning",
                                   options.thinning, "0 (off) or at most 10"));
    return requireInRange(options.decimateTo == 0 || options.decimateTo >= 4, "decimate_to",
                          static_cast<double>(options.decimateTo), "0 (never) or at least 4 points");
}

}  // namespace shapedb
