// The interior chosen by the shape itself: no angle to set, and always an answer with its worth.
#pragma once

#include <cstdint>
#include <vector>

#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/delaunay/delaunay.h"
#include "core/geometry/point.h"
#include "core/segmentation/interior_kinds.h"

namespace shapedb {

struct AdaptiveInterior {
    std::vector<std::uint8_t> inside;  ///< per tetrahedron 1 when it is interior
    InteriorSource source = InteriorSource::kWalk;
    double angleDegrees = 0.0;  ///< the deep angle of the walk; 0 for the other sources
    /// The share of the points that the boundary of the interior parts from the outside, times the
    /// square of the share of the boundary that points cover; in [0, 1]. A closed, clean scan has about
    /// 1, with a fifth of its points missing 0.8, half a sphere 0.45, an open sheet less.
    double quality = 0.0;
};

/// Weighs the interiors that walks at several angles leave, and the one that `insidePotential`
/// gives, by the same two measures of their boundary: how much of it bridges gaps wider than the
/// sampling, and how many points it leaves on one side. Takes the walk whose angle is nearest to 22
/// degrees (section 2 of docs/interior.md: the middle of what fits clean and noisy shapes)
/// among those nearly as good as the best, or the potential where it is clearly better.
///
/// Errors: kCancelled, kDeadlineExceeded. An empty interior is none.
[[nodiscard]] Result<AdaptiveInterior> adaptiveInterior(const PointCloud& points,
                                                        const Tetrahedra& tetrahedra,
                                                        const std::vector<std::uint8_t>& big,
                                                        const std::vector<double>& scales,
                                                        const RunContext& context = {});

}  // namespace shapedb
