// SPDX-License-Identifier: GPL-3.0-or-later
// Points anywhere in a box.
#pragma once

#include <cstdint>

#include "core/base/random.h"
#include "core/geometry/point.h"

namespace shapedb::testing_support {

inline PointCloud randomPoints(std::size_t count, std::uint64_t seed, const Point3& low = {0, 0, 0},
                               const Point3& high = {1, 1, 1}) {
    Random random(seed);
    PointCloud points;
    for (std::size_t i = 0; i < count; ++i) {
        points.push_back(
            {random.uniform(low.x, high.x), random.uniform(low.y, high.y), random.uniform(low.z, high.z)});
    }
    return points;
}

}  // namespace shapedb::testing_support
