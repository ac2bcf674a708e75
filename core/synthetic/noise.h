// SPDX-License-Identifier: GPL-3.0-or-later
// Degrading clean point clouds: Gaussian noise, fewer points, a table beneath.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/base/error.h"
#include "core/geometry/point.h"

namespace shapedb {

/// Adds independent Gaussian noise to every coordinate, in place. The standard deviation is
/// `shareOfDiagonal` (0.01 means 1 %) times the diagonal of the points' axis-aligned bounding box; with 0, no
/// bit changes. Since the box is axis-aligned, sigma depends a little on the pose.
///
/// Same points in the same order, share and seed: same result.
///
/// Errors (the points are unchanged): kInvalidArgument when the share is negative, NaN or infinite;
/// kNonFiniteCoordinate when a point is not finite (the message names it); kCoordinateOutOfRange when the
/// noise would take a coordinate beyond double precision.
[[nodiscard]] Result<void> addGaussianNoise(PointCloud& points, double shareOfDiagonal, std::uint64_t seed);

/// A uniformly random subset of `count` points (or all, if there are no more), in their original order. Same
/// points, count and seed: same subset.
[[nodiscard]] PointCloud subsample(const PointCloud& points, std::size_t count, std::uint64_t seed);

/// Appends `count` points of a square table just below the cloud, which stands upright along z. The table is
/// `reach` times as wide as the longer horizontal side of the cloud's box; its height has Gaussian noise of
/// the standard deviation `noise`, scan units.
void addTable(PointCloud& cloud, std::size_t count, double reach, double noise, std::uint64_t seed);

}  // namespace shapedb
