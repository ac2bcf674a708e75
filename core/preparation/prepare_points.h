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
#include "core/preparation/options.h"

namespace shapedb {

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
