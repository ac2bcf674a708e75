// How large a shape is, by a measure that does not change when the shape is turned.
#pragma once

#include "core/base/error.h"
#include "core/geometry/point.h"

namespace shapedb {

/// The smallest diagonal that an oriented box around the points can have, in their unit; 0
/// when all points are equal.
///
/// The paper scales shapes "with bounding boxes" (Section 4.2). An axis-aligned box changes
/// when the shape is turned; so does the diagonal of the box of least volume where several boxes
/// have nearly that volume. The least diagonal does not: whichever box attains it, the value is
/// the same. Found by descent from many starts over the rotations, on the convex hull;
/// docs/algorithm.md shows how little it moves.
///
/// Errors: kInvalidArgument when there are no points, kOutOfMemory, kInternal.
[[nodiscard]] Result<double> smallestBoxDiagonal(const PointCloud& points);

}  // namespace shapedb
