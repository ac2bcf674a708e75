// SPDX-License-Identifier: GPL-3.0-or-later
// Bending a scan, as joints and soft bodies do.
#pragma once

#include "core/geometry/point.h"

namespace shapedb {

/// Bends points about an axis across their longest principal axis, which becomes an arc of `radians` (below
/// 2 pi, not 0) and keeps its length; what lies across it stays perpendicular to it. Lengths change where the
/// shape is wide, not along its middle. In their order. At least one point. Pure and thread-safe.
[[nodiscard]] PointCloud bent(const PointCloud& points, double radians);

}  // namespace shapedb
