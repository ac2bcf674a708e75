// SPDX-License-Identifier: GPL-3.0-or-later
// The inner big Delaunay balls, which approximate the shape (Section 2).
#pragma once

#include <cstdint>
#include <vector>

#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/delaunay/delaunay.h"
#include "core/geometry/point.h"
#include "core/segmentation/options.h"

namespace shapedb {

/// Per tetrahedron 1 when its Delaunay ball is big: its radius exceeds bigBallRatio times the local spacing
/// of at least one of its points.
[[nodiscard]] std::vector<std::uint8_t> bigBalls(const Tetrahedra& tetrahedra,
                                                 const std::vector<double>& spacings, double bigBallRatio);

/// The angle at which two spheres meet, radians in [0, pi]: 0 when they are the same, pi when they touch
/// from outside. `shared` is any point on both.
[[nodiscard]] double intersectionAngle(const Point3& centreA, const Point3& centreB, const Point3& shared);

/// Per tetrahedron 1 when it is interior: its ball is big and the walk from outside does not reach it. The
/// walk enters through hull facets (hullAngleDegrees) and moves between adjacent tetrahedra whose balls are
/// big and intersect deeply (deepAngleDegrees).
///
/// Errors: kCancelled, kDeadlineExceeded.
[[nodiscard]] Result<std::vector<std::uint8_t>> interiorTetrahedra(const PointCloud& points,
                                                                   const Tetrahedra& tetrahedra,
                                                                   const std::vector<std::uint8_t>& big,
                                                                   const SegmentationOptions& options,
                                                                   const RunContext& context = {});

}  // namespace shapedb
