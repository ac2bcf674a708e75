// Finding points that lie off every surface.
#pragma once

#include <cstdint>
#include <vector>

#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/geometry/neighbours.h"
#include "core/geometry/point.h"

namespace shapedb {

/// Per point 1 when it is an outlier. With the reach of a point its distance to its eighth nearest
/// neighbour, a point is an outlier when
/// - its reach exceeds `ratio` times the mean reach of those eight: it stands off a surface; or
/// - its reach exceeds 2.5 times that of nine in ten points, and its neighbours surround it instead
///   of lying along a surface: it belongs to a haze; or
/// - it belongs to a group of less than 1 % of the points that no short link joins to the rest.
/// Sparsely sampled regions, thin parts and larger separate parts are kept.
///
/// `index` must hold `points`. The pose does not matter (up to rounding).
/// Errors: kCancelled, kDeadlineExceeded, kOutOfMemory.
[[nodiscard]] Result<std::vector<std::uint8_t>> findOutliers(const PointCloud& points,
                                                             const NeighbourIndex& index, double ratio,
                                                             const RunContext& context = {});

}  // namespace shapedb
