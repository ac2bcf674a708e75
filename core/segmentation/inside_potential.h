// Which side of the surface each tetrahedron is on, by evidence from all around it.
#pragma once

#include <cstdint>
#include <vector>

#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/delaunay/delaunay.h"
#include "core/geometry/point.h"

namespace shapedb {

/// The two sides of the surface at a point: the largest Delaunay ball that touches it (beyond the
/// hull: the half space outside, kNoTetrahedron) and the largest on the other side of it.
struct Poles {
    std::uint32_t first = kNoTetrahedron;   ///< kNoTetrahedron: outside the hull
    std::uint32_t second = kNoTetrahedron;  ///< kNoTetrahedron: there is none
    double cosine = 1.0;                    ///< of the angle at the point between the two directions
};

/// One per point. Linear time.
[[nodiscard]] std::vector<Poles> findPoles(const PointCloud& points, const Tetrahedra& tetrahedra);

/// A potential per tetrahedron in [-1, 1]: 1 outside the hull, passed on unchanged between balls
/// that intersect deeply and with its sign turned between the two poles of a point, which the
/// surface parts. Below 0 is inside; the magnitude tells how far all evidence agrees. A leak lets
/// in a little of the wrong sign where a walk would let in everything, and a cavity turns the sign
/// twice. Found as the least of a quadratic form (after Kolluri, Shewchuk and O'Brien, "Spectral
/// Surface Reconstruction from Noisy Point Clouds", 2004; we hold the outside fixed, so that there
/// is a linear system in place of an eigenvector), by conjugate gradients.
///
/// Errors: kCancelled, kDeadlineExceeded.
[[nodiscard]] Result<std::vector<double>> insidePotential(const PointCloud& points,
                                                          const Tetrahedra& tetrahedra,
                                                          const std::vector<Poles>& poles,
                                                          const RunContext& context = {});

}  // namespace shapedb
