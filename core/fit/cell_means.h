// SPDX-License-Identifier: GPL-3.0-or-later
// Means of the points in the cells of a cubic grid. For the sources of this folder.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/geometry/point.h"

namespace shapedb {

struct CellMean {
    Point3 mean;
    std::uint64_t count = 0;  ///< points in the cell
};

struct CellMeans {
    std::vector<CellMean> cells;
    std::vector<std::uint32_t> cellOfPoint;  ///< point -> index into `cells`
};

/// The means of the finest grid that gives at most `most` (at least 1); of points that have no more distinct
/// places, the points themselves. Points must be finite, with coordinates in [-1, 1], and at least one.
/// Sums are exact, so the means do not depend on the order of the points, but the order of `cells` is by
/// place. Time: that of a few sorts. Errors: kCancelled, kDeadlineExceeded.
[[nodiscard]] Result<CellMeans> cellMeans(const PointCloud& points, std::size_t most,
                                          const RunContext& context);

}  // namespace shapedb
