// SPDX-License-Identifier: GPL-3.0-or-later
// Scans of synthetic shapes as packed floats.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/geometry/point.h"

namespace shapedb::testing {

/// Packed x y z.
using Scan = std::vector<float>;

[[nodiscard]] Scan pack(const PointCloud& points);
[[nodiscard]] PointCloud unpack(const Scan& scan);

/// Two balls and a rod: segments well. Another seed is another scan of the same shape.
[[nodiscard]] Scan dumbbell(std::uint64_t seed = 1, std::size_t points = 2'000);
/// Member `index` of a family of core/synthetic, in a pose of its own.
[[nodiscard]] Scan familyScan(const std::string& family, std::size_t index, std::uint64_t seed = 1,
                              std::size_t points = 3'000);
/// A shallow bowl: valid points without an interior.
[[nodiscard]] Scan openSheet();
/// A closed shape with enough points to make its segmentation slow.
[[nodiscard]] Scan slowScan(std::uint64_t seed = 1, std::size_t points = 150'000);

}  // namespace shapedb::testing
