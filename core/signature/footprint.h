// The outline of a shape as it lies: what a scan of one side shows as well as a scan all around.
#pragma once

#include <array>
#include <vector>

#include "core/geometry/point.h"

namespace shapedb {

/// A point of the outline, in units of its length: along its long axis, 0 to 1 but for the last
/// half per cent at either end, and across, signed, from the axis.
using OutlinePoint = std::array<double, 2>;

/// The surface seen along the direction in which it extends least, as cells of a square grid, one
/// point a cell: a cell counts once whether one side of the surface, both, or a fold lies over it.
/// Cells are two spacings of the points wide, at least a hundredth of the length. Which end is 0
/// and which side is positive is chance. Empty when the points have no extent.
///
/// `surface`: at least 4 points, distinct. Deterministic.
[[nodiscard]] std::vector<OutlinePoint> footprint(const PointCloud& surface);

}  // namespace shapedb
