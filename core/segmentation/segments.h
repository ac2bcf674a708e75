// Grouping interior tetrahedra into segments: stable manifolds of maxima (Section 3.2) and
// their merging (Section 3.3).
#pragma once

#include <cstdint>
#include <vector>

#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/delaunay/delaunay.h"
#include "core/geometry/point.h"

namespace shapedb {

/// A partition of the interior: per tetrahedron the segment's index, -1 outside; per segment
/// the tetrahedron that holds its maximum (its largest Delaunay ball by the order of claiming).
struct SegmentLabels {
    std::vector<std::int32_t> ofTetrahedron;
    std::vector<std::uint32_t> maxima;
};

/// Stable manifolds of the maxima. Maxima are taken by falling circumradius; each claims, depth
/// first, the unclaimed tetrahedra that flow into what it holds: so a tetrahedron that flows
/// into two goes to the stronger (the relation ~< of the paper).
///
/// The paper leaves open what becomes of interior tetrahedra that only flow out of the interior.
/// Here they join, layer by layer, the adjacent labelled tetrahedron with the largest ball; those
/// that hang together with no maximum at all form a segment of their own around their largest
/// ball. So the segments partition the interior.
///
/// Errors: kCancelled, kDeadlineExceeded.
[[nodiscard]] Result<SegmentLabels> stableManifolds(const Tetrahedra& tetrahedra,
                                                    const std::vector<std::uint8_t>& interior,
                                                    const std::vector<std::uint8_t>& flow,
                                                    const RunContext& context = {});

/// Circumradius of facet i of tetrahedron t.
[[nodiscard]] double facetCircumradius(const PointCloud& points, const Tetrahedra& tetrahedra, std::size_t t,
                                       int facet);

/// Merges every two segments that share a triangle of circumradius r with both maxima at most
/// mergeRatio * r (the maxima before any merging, literally as published; chains of such pairs
/// become one segment). Labels of the result are dense, by falling maximum.
[[nodiscard]] SegmentLabels mergeSegments(const PointCloud& points, const Tetrahedra& tetrahedra,
                                          SegmentLabels labels, double mergeRatio);

}  // namespace shapedb
