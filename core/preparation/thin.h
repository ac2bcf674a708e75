// SPDX-License-Identifier: GPL-3.0-or-later
// Thinning to an even density: no two points that stay are closer than a given distance.
#pragma once

#include <cstdint>
#include <vector>

#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/geometry/neighbours.h"
#include "core/geometry/point.h"

namespace shapedb {

struct ThinnedPoints {
    PointCloud points;                       ///< a subset of the points given, in their order
    std::vector<std::uint32_t> siteOfPoint;  ///< input point -> its representative in `points`
};

/// Goes through the points by distance from their centroid and keeps each that has no kept point within
/// `spacing`. Sparse regions stay as they are, and nothing is averaged across a thin part. The choice does
/// not depend on the pose (up to rounding). A spacing of 0 keeps all. `index` must hold `points`.
///
/// Errors: kCancelled, kDeadlineExceeded, kOutOfMemory.
[[nodiscard]] Result<ThinnedPoints> thin(const PointCloud& points, const NeighbourIndex& index,
                                         double spacing, const RunContext& context = {});

}  // namespace shapedb
