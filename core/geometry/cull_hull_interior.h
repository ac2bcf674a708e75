// SPDX-License-Identifier: GPL-3.0-or-later
// Dropping points that cannot lie on the convex hull, in linear time.
#pragma once

#include "core/geometry/point.h"

namespace shapedb {

/// The points, in order, without those that certainly lie inside the convex hull of the rest. Every
/// hull vertex stays; of a scan usually only a small share does.
[[nodiscard]] PointCloud cullHullInterior(const PointCloud& points);

}  // namespace shapedb
