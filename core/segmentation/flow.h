// The discrete flow of the distance function between tetrahedra (Section 3.2).
#pragma once

#include <cstdint>
#include <vector>

#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/delaunay/delaunay.h"
#include "core/geometry/point.h"

namespace shapedb {

/// Per tetrahedron a mask: bit i is set when it flows through its facet i, that is, when its
/// circumcentre lies strictly beyond the facet's plane. At most two bits are set. A mask of 0
/// is a maximum: the circumcentre lies in its own tetrahedron. Exact: what double precision
/// cannot decide is decided with rational numbers, so the flow has no cycles. Only tetrahedra
/// with `wanted` set are computed, the others get 0.
///
/// Precondition: coordinates as sanitise returns them. Errors: kCancelled, kDeadlineExceeded.
[[nodiscard]] Result<std::vector<std::uint8_t>> flowMasks(const PointCloud& points,
                                                          const Tetrahedra& tetrahedra,
                                                          const std::vector<std::uint8_t>& wanted,
                                                          const RunContext& context = {});

}  // namespace shapedb
