// SPDX-License-Identifier: GPL-3.0-or-later
// What scanners miss: scans from one side, and pieces.
//
// All functions are pure and thread-safe.
#pragma once

#include "core/geometry/point.h"

namespace shapedb {

/// The points that a far camera sees when it looks along -`towards`, a unit vector from the shape to the
/// camera: per pixel of a depth buffer the nearest one, and what lies at most two pixels behind. A pixel is
/// as wide as the points' mean spacing over the silhouette asks for, so that the back does not shine through
/// a closed surface sampled evenly. In their order.
[[nodiscard]] PointCloud seenFrom(const PointCloud& points, const Point3& towards);

/// The share (0 to 1) of the points that lies least far in a direction: the rest is cut off by a plane. In
/// their order; of points at the plane those that come first.
[[nodiscard]] PointCloud cutBelow(const PointCloud& points, const Point3& direction, double share);

/// Leaves out what lies within `radius` of a centre, as where nothing was measured. In their order.
[[nodiscard]] PointCloud withHole(const PointCloud& points, const Point3& centre, double radius);

}  // namespace shapedb
