// SPDX-License-Identifier: GPL-3.0-or-later
// Which side of the surface each tetrahedron is on, by global evidence instead of a walk.
#pragma once

#include <cstdint>
#include <vector>

#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/delaunay/delaunay.h"
#include "core/geometry/point.h"

namespace shapedb {

/// The poles of a point (Amenta and Bern 1998), one on either side of the surface: the largest Delaunay ball
/// that touches the point (on the hull: the half space outside), and the largest on the other side.
struct Poles {
    std::uint32_t first = kNoTetrahedron;   ///< kNoTetrahedron: outside the hull
    std::uint32_t second = kNoTetrahedron;  ///< kNoTetrahedron: there is none
    double cosine = 1.0;                    ///< of the angle at the point between the directions to both
};

/// One pair per point. Linear time.
[[nodiscard]] std::vector<Poles> findPoles(const PointCloud& points, const Tetrahedra& tetrahedra);

/// A potential per tetrahedron, in [-1, 1]: negative inside, its magnitude telling how far the evidence
/// agrees. It is 1 outside the hull, tends to be equal where balls intersect deeply, and opposite at the two
/// poles of a point. A leak lets in a little of the wrong sign where a walk would let in everything, and a
/// cavity flips the sign twice.
///
/// After Kolluri, Shewchuk and O'Brien, "Spectral Surface Reconstruction from Noisy Point Clouds" (2004).
///
/// Errors: kCancelled, kDeadlineExceeded.
[[nodiscard]] Result<std::vector<double>> insidePotential(const PointCloud& points,
                                                          const Tetrahedra& tetrahedra,
                                                          const std::vector<Poles>& poles,
                                                          const RunContext& context = {});

}  // namespace shapedb
