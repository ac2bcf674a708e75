// Points that lie off every surface.
#pragma once

#include <cstdint>
#include <vector>

#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/geometry/neighbours.h"
#include "core/geometry/point.h"

namespace shapedb {

/// Per point 1 when it is a stray: the distance to its eighth nearest neighbour exceeds
/// `ratio` times the mean of that distance at those eight. A comparison with the
/// neighbourhood, not with the scan: points of a sparsely sampled region are no strays.
///
/// `index` must hold `points`. Errors: kCancelled, kDeadlineExceeded, kOutOfMemory.
[[nodiscard]] Result<std::vector<std::uint8_t>> findStrays(const PointCloud& points,
                                                           const NeighbourIndex& index, double ratio,
                                                           const RunContext& context = {});

}  // namespace shapedb
