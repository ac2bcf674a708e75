// SPDX-License-Identifier: GPL-3.0-or-later
// The outline of a shape as it lies: a scan of one side shows it as well as a scan of all sides.
#pragma once

#include <array>
#include <vector>

#include "core/geometry/point.h"

namespace shapedb {

/// A point of the outline, in units of its length: along its long axis, where 0 and 1 leave out half a per
/// cent at either end, and across, signed, from the axis.
using OutlinePoint = std::array<double, 2>;

/// The surface projected along its shortest principal axis, one point per occupied cell of a square grid: so
/// it makes no difference whether one side of the surface lies over a cell, or both, or a fold. Cells are two
/// spacings of the points wide, at least a hundredth of the length. Which end is 0 and which side is positive
/// is arbitrary. Empty when the points have no extent.
///
/// `surface`: at least 4 distinct points. Deterministic.
[[nodiscard]] std::vector<OutlinePoint> footprint(const PointCloud& surface);

}  // namespace shapedb
