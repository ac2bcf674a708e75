// SPDX-License-Identifier: GPL-3.0-or-later
// All of the preparation: from a scan to the points that are triangulated.
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/geometry/point.h"
#include "core/preparation/denoise.h"
#include "core/preparation/frame.h"

namespace shapedb {

/// Off by default, as in the paper: every point counts where it is.
struct PreparationOptions {
    /// Scans with more distinct points than this are averaged onto a grid of about as many
    /// cells. At least 4, or 0: never.
    std::uint32_t decimateTo = 0;

    /// Outliers are left out: points whose distance to their eighth neighbour exceeds this many
    /// times the mean of the same distance at those neighbours. > 1, or 0: none are.
    double outlierRatio = 0.0;

    /// Noisy points are moved onto a surface fitted to their neighbours within this many standard
    /// deviations of the estimated noise. In [1, 20], or 0: points stay where they are. Too small
    /// leaves noise, too large shrinks thin parts.
    double smoothingReach = 0.0;

    /// Points are thinned until no two are closer than this many times the smallest distance
    /// that sampling and noise can resolve. In (0, 10], or 0: all stay.
    double thinning = 0.0;
};

/// Errors: kInvalidArgument naming the field, its value and its range.
[[nodiscard]] Result<void> validate(const PreparationOptions& options);

/// In place of a site: the point was left out.
constexpr std::uint32_t kNoSite = 0xffffffffu;

struct PreparedPoints {
    PointCloud sites;  ///< distinct, in the unit frame, in lexicographic order
    Frame frame;
    std::vector<std::uint32_t> siteOfPoint;  ///< input point -> index into `sites`, or kNoSite
    std::uint64_t duplicates = 0;       ///< input points that repeated another; not counted (0) when the scan
                                        ///< was decimated by gridScan
    std::uint64_t distinct = 0;         ///< sites before smoothing and thinning: what the scan shows
    std::uint64_t outliers = 0;         ///< input points left out
    std::uint64_t outlierClusters = 0;  ///< separate groups of nine sites or more among them
    NoiseEstimate noise;                ///< before smoothing, unit frame; zero when not measured
    double spacing = 0.0;               ///< the sites' own, unit frame; zero when not measured
};

/// Runs the enabled steps, in this order: sanitise, decimate, outliers, smooth, thin. `begin` is called
/// with the name of each as it starts; an error from it stops the work.
///
/// Errors: those of the steps and of `begin`; kTooFewPoints when fewer than 4 points are left.
[[nodiscard]] Result<PreparedPoints> preparePoints(const PointCloud& points,
                                                   const PreparationOptions& options,
                                                   const RunContext& context,
                                                   const std::function<Result<void>(const char*)>& begin);

}  // namespace shapedb
