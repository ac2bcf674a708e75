// Points that lie off every surface.
#pragma once

#include <cstdint>
#include <vector>

#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/geometry/neighbours.h"
#include "core/geometry/point.h"

namespace shapedb {

/// Per point 1 when it is an outlier. The reach of a point is the distance to its eighth nearest
/// neighbour. A point is an outlier when
/// - its reach exceeds `ratio` times the mean reach of those eight: it stands off a surface; or
/// - its reach exceeds 2.5 times what nine in ten points have, and its neighbours surround it in
///   space instead of lying along a surface: it belongs to a haze; or
/// - it belongs to a group of less than 1 % of the points that no short link joins to the rest.
/// A region of a surface that is sampled more sparsely, a thin part, and a part apart that
/// holds more points are none of these.
///
/// `index` must hold `points`. The same points in any pose give the same answer up to rounding.
/// Errors: kCancelled, kDeadlineExceeded, kOutOfMemory.
[[nodiscard]] Result<std::vector<std::uint8_t>> findOutliers(const PointCloud& points,
                                                             const NeighbourIndex& index, double ratio,
                                                             const RunContext& context = {});

}  // namespace shapedb
