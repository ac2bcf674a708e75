// Leaving out what cannot be on the convex hull, in linear time.
#pragma once

#include "core/geometry/point.h"

namespace shapedb {

/// The points, in their order, without those that certainly lie inside the convex hull of the others: no
/// vertex of the hull is left out. Usually a small share of a scan is left. Linear time.
[[nodiscard]] PointCloud cullHullInterior(const PointCloud& points);

}  // namespace shapedb
