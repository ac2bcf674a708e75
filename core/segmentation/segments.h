// SPDX-License-Identifier: GPL-3.0-or-later
// Grouping interior tetrahedra into segments: the stable manifolds of maxima (Section 3.2), and
// their merging (Section 3.3).
#pragma once

#include <cstdint>
#include <vector>

#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/delaunay/delaunay.h"
#include "core/geometry/point.h"

namespace shapedb {

/// A partition of the interior.
struct SegmentLabels {
    std::vector<std::int32_t> ofTetrahedron;  ///< per tetrahedron its segment, -1 outside
    std::vector<std::uint32_t> maxima;        ///< per segment the tetrahedron of its maximum
};

/// Stable manifolds of the maxima, numbered in descending order of circumradius. A tetrahedron that flows
/// into two belongs to the stronger one (the relation ~< of the paper).
///
/// The paper leaves open what becomes of interior tetrahedra that flow out of the interior only. Here they
/// join, layer by layer, the adjacent labelled tetrahedron with the largest ball. Connected groups without
/// any maximum ("islands") become segments of their own, around their largest ball, and come last.
///
/// Errors: kCancelled, kDeadlineExceeded.
[[nodiscard]] Result<SegmentLabels> stableManifolds(const Tetrahedra& tetrahedra,
                                                    const std::vector<std::uint8_t>& interior,
                                                    const std::vector<std::uint8_t>& flow,
                                                    const RunContext& context = {});

/// Merges every two segments that share a triangle of circumradius r when both maxima are at most
/// mergeRatio * r. As published, these are the maxima before any merging, and chains of such pairs become one
/// segment. The result is numbered in descending order of maximum.
[[nodiscard]] SegmentLabels mergeSegments(const PointCloud& points, const Tetrahedra& tetrahedra,
                                          SegmentLabels labels, double mergeRatio);

}  // namespace shapedb
