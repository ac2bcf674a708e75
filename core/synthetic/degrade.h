// SPDX-License-Identifier: GPL-3.0-or-later
// Degrading clean point clouds: Gaussian noise, fewer points, a table beneath, scans from one side, pieces.
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

// What scanners miss: scans from one side, and pieces.
//
// All functions are pure and thread-safe.

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
