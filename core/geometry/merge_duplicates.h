// SPDX-License-Identifier: GPL-3.0-or-later
// Sorting points and merging equal ones.
#pragma once

#include <cstdint>
#include <vector>

#include "core/geometry/point.h"

namespace shapedb {

struct MergedPoints {
    PointCloud points;                       ///< distinct, in lexicographic order
    std::vector<std::uint32_t> siteOfPoint;  ///< input point -> index into `points`
};

/// Merges points that are exactly equal. `points` must be finite; at most 2^32 - 2 of them. Linear time
/// unless most points share a few values of x.
[[nodiscard]] MergedPoints mergeDuplicates(const PointCloud& points);

}  // namespace shapedb
