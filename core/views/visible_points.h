// SPDX-License-Identifier: GPL-3.0-or-later
// Which surface points a far camera sees. For the sources of this folder.
#pragma once

#include "core/geometry/point.h"
#include "core/views/view_signature.h"

namespace shapedb {

/// The points of `surface` that a depth buffer along -`towards` (a unit vector) shows: per pixel what lies at
/// most two pixels behind the nearest of `hiding`, points of the same surface, or more of them. A pixel is as
/// wide as holds `perPixel` of those on average, if the whole box of the outline were covered. Points of
/// `hiding` outside the outline of `surface` hide nothing. In their order; independent of that of `hiding`.
[[nodiscard]] SeenSurface visiblePoints(const SeenSurface& surface, const PointCloud& hiding,
                                        const Point3& towards, double perPixel);

}  // namespace shapedb
