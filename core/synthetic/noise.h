// Making a clean point cloud worse on purpose: Gaussian noise and random thinning.
#pragma once

#include <cstddef>
#include <cstdint>

#include "core/base/error.h"
#include "core/geometry/point.h"

namespace shapedb {

/// Adds independent Gaussian noise to every coordinate, in place. The standard deviation is
/// `shareOfDiagonal` (0.01 means 1 %) times the diagonal of the axis-aligned bounding box the
/// points have before the call. A share of 0 leaves every bit of the points as it was, and so
/// does an empty cloud.
///
/// Same points in the same order, share and seed: same result. Because the box is axis-aligned,
/// rotating the points first changes the sigma a little; compare noise levels in one pose.
///
/// Errors: kInvalidArgument when the share is negative, NaN or infinite;
/// kNonFiniteCoordinate when a point is not finite (the message names it);
/// kCoordinateOutOfRange when the noise would take a coordinate beyond double precision.
/// On any error the points are unchanged.
[[nodiscard]] Result<void> addGaussianNoise(PointCloud& points, double shareOfDiagonal, std::uint64_t seed);

/// A uniformly random subset of `count` points without replacement, in their original order.
/// `count` at or above the size returns all points. Same points, count and seed: same subset.
[[nodiscard]] PointCloud subsample(const PointCloud& points, std::size_t count, std::uint64_t seed);

}  // namespace shapedb
