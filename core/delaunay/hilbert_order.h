// An order in which neighbours in space are mostly neighbours in memory.
#pragma once

#include <cstdint>
#include <vector>

#include "core/geometry/point.h"

namespace shapedb {

/// The indices of the points along a Hilbert curve through their bounding box, of 2^21 steps along each
/// axis; points in one step by index. Depends on the points and their order alone.
///
/// Preconditions: finite coordinates, less than 2^32 points. Linear time.
[[nodiscard]] std::vector<std::uint32_t> hilbertOrder(const PointCloud& points);

}  // namespace shapedb
