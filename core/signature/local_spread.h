// SPDX-License-Identifier: GPL-3.0-or-later
// What the surface around a point looks like at a tenth of the shape's size: a rod, a sheet or a body.
#pragma once

#include <cstddef>
#include <vector>

#include "core/geometry/point.h"

namespace shapedb {

/// Standard deviations of the surface within kSpreadReach of a point along their principal axes, over the
/// largest of them: (0, 0) for a thin rod, (1, 0) for a thin sheet, (1, 1) for a ball.
struct LocalSpread {
    double middle = 0.0;    ///< [0, 1]
    double shortest = 0.0;  ///< [0, middle]
};

constexpr double kSpreadReach = 0.1;             ///< in the unit of the points, the shape's size
constexpr std::size_t kSpreadNeighbours = 4000;  ///< at most this many random points are considered
constexpr std::size_t kSpreadPlaces = 1000;      ///< of which at most this many as centres

/// At random points of `surface` (one or more), without those that have no neighbours. Deterministic.
[[nodiscard]] std::vector<LocalSpread> localSpread(const PointCloud& surface);

}  // namespace shapedb
