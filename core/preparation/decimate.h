// SPDX-License-Identifier: GPL-3.0-or-later
// Decimating a dense scan: one averaged point per occupied cell of a cubic grid. Where points
// overlap, averaging also cancels part of the scanner's noise.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/geometry/point.h"

namespace shapedb {

struct DecimatedPoints {
    PointCloud points;                       ///< distinct, in lexicographic order
    std::vector<std::uint32_t> siteOfPoint;  ///< input point -> index into `points`
    double cellSize = 0.0;                   ///< edge of a grid cell, in the points' unit; 0: not decimated
};

/// At most `target` points, usually at least nine tenths of that. A scan that has no more is only
/// merged and sorted. The choice of the cell size depends on the points alone, not on their order.
///
/// Precondition: coordinates in [-1, 1], as `sanitise` returns them.
/// Errors: kInvalidArgument when target < 4; kCancelled, kDeadlineExceeded; kOutOfMemory.
[[nodiscard]] Result<DecimatedPoints> decimate(const PointCloud& points, std::size_t target,
                                               const RunContext& context = {});

}  // namespace shapedb
