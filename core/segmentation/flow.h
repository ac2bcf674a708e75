// SPDX-License-Identifier: GPL-3.0-or-later
// The discrete flow of the distance function between tetrahedra (Section 3.2).
#pragma once

#include <cstdint>
#include <vector>

#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/delaunay/delaunay.h"
#include "core/geometry/point.h"

namespace shapedb {

/// Per tetrahedron a mask whose bit i is set when it flows through facet i: when its circumcentre lies
/// strictly beyond that facet's plane. At most two bits are set; none at a maximum, whose circumcentre lies
/// in its own tetrahedron. Exact, so the flow has no cycles. Tetrahedra without `wanted` get 0.
///
/// Precondition: coordinates in [-1, 1], as `sanitise` returns them. Errors: kCancelled, kDeadlineExceeded.
[[nodiscard]] Result<std::vector<std::uint8_t>> flowMasks(const PointCloud& points,
                                                          const Tetrahedra& tetrahedra,
                                                          const std::vector<std::uint8_t>& wanted,
                                                          const RunContext& context = {});

}  // namespace shapedb
