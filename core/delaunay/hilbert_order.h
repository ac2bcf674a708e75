// SPDX-License-Identifier: GPL-3.0-or-later
// Hilbert order: points that are close in space are mostly close in memory.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "core/geometry/point.h"

namespace shapedb {

/// The indices of the points in the order in which a Hilbert curve through their bounding box, 2^21 steps
/// along each axis, visits them; points in the same step by index. Linear time.
///
/// Preconditions: finite coordinates, fewer than 2^32 points. May throw std::bad_alloc.
[[nodiscard]] std::vector<std::uint32_t> hilbertOrder(const PointCloud& points);

/// Points that have been put in Hilbert order. Only the constructor makes one, so a function that takes this
/// type never has to sort again.
class HilbertSortedCloud {
  public:
    /// Preconditions and exceptions: as hilbertOrder.
    explicit HilbertSortedCloud(const PointCloud& unsorted);

    const PointCloud& points() const { return points_; }
    /// By point: its index in the unsorted cloud.
    const std::vector<std::uint32_t>& order() const { return order_; }
    PointCloud takePoints() && { return std::move(points_); }

  private:
    std::vector<std::uint32_t> order_;
    PointCloud points_;
};

}  // namespace shapedb
