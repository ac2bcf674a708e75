// How large a shape is, by a measure that does not change when the shape is turned.
#pragma once

#include "core/base/error.h"
#include "core/geometry/point.h"

namespace shapedb {

/// Diameter of the smallest sphere around the points, in their unit: exactly invariant
/// under rotation and reflection (up to rounding), unique, and fixed by at most four points.
/// 0 for a single point. Expected linear time (Gaertner's algorithm in CGAL).
///
/// Errors: kInvalidArgument when there are no points, kOutOfMemory, kInternal.
[[nodiscard]] Result<double> smallestSphereDiameter(const PointCloud& points);

}  // namespace shapedb
