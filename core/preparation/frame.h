// SPDX-License-Identifier: GPL-3.0-or-later
// The unit frame, in which all geometry is done.
#pragma once

#include "core/base/error.h"
#include "core/geometry/point.h"

namespace shapedb {

/// Largest magnitude of a coordinate, and smallest half extent of a scan, in scan units: what single
/// precision, the wire format, holds with all its digits.
constexpr double kMaxCoordinate = 3.4e38;
constexpr double kMinHalfExtent = 1.2e-38;

/// scan = centre + unit * p, with p in [-1, 1] on each axis. The unit is a power of two, so scaling a scan
/// by a power of two changes no digit of what follows.
struct Frame {
    Point3 centre;      ///< middle of the axis-aligned bounding box, scan units
    double unit = 1.0;  ///< scan units per unit of the frame, > 0

    Point3 toScan(const Point3& p) const { return centre + unit * p; }
};

/// Checks the number of points and their coordinates, and finds the frame.
///
/// Errors, each naming the first offending point or the measure: kTooFewPoints (fewer than 4),
/// kPointLimitExceeded (2^32 - 1 or more), kNonFiniteCoordinate, kCoordinateOutOfRange (a magnitude over
/// kMaxCoordinate, or a half extent under kMinHalfExtent), kAllPointsEqual.
[[nodiscard]] Result<Frame> frameOf(const PointCloud& scan);

}  // namespace shapedb
