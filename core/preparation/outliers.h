// SPDX-License-Identifier: GPL-3.0-or-later
// Finding points that lie off every surface.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/geometry/neighbours.h"
#include "core/geometry/point.h"

namespace shapedb {

struct Outliers {
    std::vector<std::uint8_t> isOutlier;  ///< for each point: 1 or 0
    std::uint64_t clusters = 0;           ///< separate groups of nine points or more among the outliers
    std::size_t bodyPoints = 0;  ///< half of the points belong to separate groups of at least this many
};

/// With the reach of a point its distance to its eighth nearest neighbour, a point is an outlier when
/// - its reach exceeds `ratio` times the mean reach of those eight: it stands off a surface; or
/// - its reach exceeds 2.5 times that of nine in ten points, and its neighbours surround it instead
///   of lying along a surface: it belongs to a haze; or
/// - it belongs to a group that no short link joins to the rest, and that is small and rare: less than 1 %
///   of the points, and either fewer than 24 points, or less than 5 % of the points together with all
///   groups of half to twice its size.
/// Sparsely sampled regions, thin parts, larger separate parts and the many equal parts of a set are kept.
///
/// `index` must hold `points`. The pose does not matter (up to rounding).
/// Errors: kCancelled, kDeadlineExceeded, kOutOfMemory.
[[nodiscard]] Result<Outliers> findOutliers(const PointCloud& points, const NeighbourIndex& index,
                                            double ratio, const RunContext& context = {});

}  // namespace shapedb
