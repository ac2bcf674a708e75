// SPDX-License-Identifier: GPL-3.0-or-later
// Where segments touch, and how wide the saddle between them is.
#pragma once

#include <cstdint>
#include <vector>

#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/delaunay/delaunay.h"
#include "core/geometry/point.h"

namespace shapedb {

/// Two segments that share triangles.
struct SegmentContact {
    std::uint32_t first = 0;   ///< index of a segment
    std::uint32_t second = 0;  ///< index of another, above `first`
    /// Radius of the largest ball empty of points that can pass from one into the other along the
    /// Voronoi edges between them: the distance function at the saddle. Unit of the points, > 0.
    double saddleRadius = 0.0;
    double area = 0.0;  ///< of the shared triangles, unit of the points squared, >= 0
};

/// All contacts, by `first`, then `second`; each pair once.
///
/// Preconditions: `flow` as flowMasks returns it for the labelled tetrahedra; labels below
/// 2^31. Errors: kCancelled, kDeadlineExceeded.
[[nodiscard]] Result<std::vector<SegmentContact>> segmentContacts(const PointCloud& points,
                                                                  const Tetrahedra& tetrahedra,
                                                                  const std::vector<std::uint8_t>& flow,
                                                                  const std::vector<std::int32_t>& labels,
                                                                  const RunContext& context = {});

}  // namespace shapedb
