// SPDX-License-Identifier: GPL-3.0-or-later
// The axes along which points spread most and least.
#pragma once

#include "core/geometry/motion.h"
#include "core/geometry/point.h"

namespace shapedb {

/// Unit vectors as rows, longest spread first, right-handed; their signs mean nothing. At least one point,
/// all finite. Points that spread alike in several directions leave those axes open.
[[nodiscard]] Matrix3 principalAxes(const PointCloud& points);

}  // namespace shapedb
