// SPDX-License-Identifier: GPL-3.0-or-later
// An interior without an angle to set: chosen from the shape itself, with a figure of its quality.
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
    double angleDegrees = 0.0;  ///< deep angle of the walk; 0 for the other sources
    /// The fraction of points with the interior on one side and the outside on the other, times the square
    /// of the fraction of the boundary that points cover; in [0, 1]. About 1 for a closed, clean scan, 0.8
    /// with a fifth of it missing, 0.45 for half a sphere, less for an open sheet.
    double quality = 0.0;
};

/// Compares the interiors left by walks at all angles and that of `insidePotential` by two measures
/// of their boundary: how much of it bridges gaps wider than the sampling, and how many points it leaves
/// on one side. Prefers walks, and angles near 22 degrees (docs/interior.md, section 2).
///
/// Errors: kCancelled, kDeadlineExceeded. An empty interior is not an error.
[[nodiscard]] Result<AdaptiveInterior> adaptiveInterior(const PointCloud& points,
                                                        const Tetrahedra& tetrahedra,
                                                        const std::vector<std::uint8_t>& big,
                                                        const std::vector<double>& spacings,
                                                        const RunContext& context = {});

}  // namespace shapedb
