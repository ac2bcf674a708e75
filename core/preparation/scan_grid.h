// SPDX-License-Identifier: GPL-3.0-or-later
// `sanitise` and `decimate` in one pass over a large scan, without copying or sorting its points.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/geometry/point.h"
#include "core/preparation/frame.h"

namespace shapedb {

struct GriddedScan {
    PointCloud points;                       ///< distinct, in the unit frame, in lexicographic order
    std::vector<std::uint32_t> siteOfPoint;  ///< point of the scan -> index into `points`
    Frame frame;
};

/// For scans of far more than `target` points: one mean per occupied cell of a cubic grid, at most
/// `target`, usually at least nine tenths of that. It differs from `sanitise` and `decimate` in that
/// repeated points count each time, and that points are first gathered in small cells (at most eight times
/// `target`), each of which then goes as a whole to the grid cell that its mean lies in.
///
/// Sums are exact, so neither the order of the points nor the number of threads (those of the caller's
/// arena) changes a bit. Linear time. Memory besides the result: about 100 bytes per small cell and thread.
///
/// Nothing when the scan occupies so few cells that it may have fewer than `target` distinct points: use
/// `sanitise` then. Errors: those of `sanitise` (flatness is judged by the means of the small cells);
/// kCancelled, kDeadlineExceeded.
[[nodiscard]] Result<std::optional<GriddedScan>> gridScan(const PointCloud& scan, std::size_t target,
                                                          const RunContext& context = {});

}  // namespace shapedb
