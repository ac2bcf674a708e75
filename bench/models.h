// SPDX-License-Identifier: GPL-3.0-or-later
// Models that queries are simulated from, and how a query and its shape in the gallery share no point.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "core/base/error.h"
#include "core/geometry/point.h"

namespace shapedb::bench {

/// A scan of a member of a synthetic family.
struct FamilyScan {
    std::string family;
    std::size_t member = 0;
    PointCloud points;
};

/// `members` of each family, scanned without noise in poses of their own, `points` each. Member i of every
/// family has the seed `seed` + i.
[[nodiscard]] Result<std::vector<FamilyScan>> scansOfFamilies(std::size_t members, std::size_t points,
                                                              std::uint64_t seed);

/// Every other point, from the first (0) or the second (1) on.
[[nodiscard]] PointCloud halfOf(const PointCloud& points, std::size_t which);

}  // namespace shapedb::bench
