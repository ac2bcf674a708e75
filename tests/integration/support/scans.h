// Scans for the tests: the project's own synthetic shapes as packed floats.
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
/// A shallow bowl: valid points, but every Delaunay ball is as good as the half space above.
[[nodiscard]] Scan openSheet();
/// A closed shape of so many points that its segmentation takes a while.
[[nodiscard]] Scan slowScan(std::uint64_t seed = 1, std::size_t points = 150'000);

}  // namespace shapedb::testing
