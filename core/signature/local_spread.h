// What the surface is like around a point, as seen from a little way off: a rod, a sheet or a body.
#pragma once

#include <cstddef>
#include <vector>

#include "core/geometry/point.h"

namespace shapedb {

/// The standard deviations of the surface within kSpreadReach of a point, along their principal axes,
/// as shares of the longest: (0, 0) a thin rod, (1, 0) a thin sheet, (1, 1) a ball.
struct LocalSpread {
    double middle = 0.0;    ///< [0, 1]
    double shortest = 0.0;  ///< [0, middle]
};

constexpr double kSpreadReach = 0.1;             ///< units of the points: of the shape's size
constexpr std::size_t kSpreadNeighbours = 4000;  ///< of at most this many points
constexpr std::size_t kSpreadPlaces = 1000;      ///< at this many, or at all there are

/// At points drawn at random from `surface` (one or more); fewer where points have no neighbours.
/// Deterministic.
[[nodiscard]] std::vector<LocalSpread> localSpread(const PointCloud& surface);

}  // namespace shapedb
