// How densely the shape is sampled around each point (Section 2).
#pragma once

#include <vector>

#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/geometry/point.h"

namespace shapedb {

/// For each point the mean distance to its three nearest other points, in their unit; infinite when there
/// are fewer than three. Points should be in Hilbert order (hilbert_order.h): the result is the same in any
/// order, but the time may grow with the square of their number. On the threads of the caller's arena.
///
/// Errors: kCancelled, kDeadlineExceeded. May throw std::bad_alloc.
[[nodiscard]] Result<std::vector<double>> localSpacings(const PointCloud& points,
                                                        const RunContext& context = {});

}  // namespace shapedb
