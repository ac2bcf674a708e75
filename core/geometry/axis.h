// SPDX-License-Identifier: GPL-3.0-or-later
// A coordinate chosen by the number of its axis.
#pragma once

namespace shapedb {

/// x, y or z of a point, or of anything that has them, for axis 0, 1 or 2.
template <typename Point, typename Axis>
double coordinate(const Point& p, Axis axis) {
    return axis == 0 ? p.x : axis == 1 ? p.y : p.z;
}

}  // namespace shapedb
