// Thinning a dense scan: one averaged point per occupied cell of a cubic grid. Averaging
// also cancels part of the scanner's noise where points overlap.
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
    double cellSize = 0.0;  ///< edge of a grid cell, in the points' unit; 0: nothing was done
};

/// At most `target` points, usually at least nine tenths of that. Scans that have no more
/// already come back merged and sorted but otherwise unchanged. The cell size is found by a
/// few secant and bisection steps: a surface's cells grow with the inverse square of the size.
///
/// Precondition: finite coordinates with magnitude at most 1 (as sanitise returns them).
/// Errors: kInvalidArgument when target < 4; kCancelled, kDeadlineExceeded; kOutOfMemory.
[[nodiscard]] Result<DecimatedPoints> decimate(const PointCloud& points, std::size_t target,
                                               const RunContext& context = {});

}  // namespace shapedb
