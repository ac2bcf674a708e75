// SPDX-License-Identifier: GPL-3.0-or-later
// The same scan in another order and another pose.
#pragma once

#include <cmath>
#include <cstdint>
#include <utility>

#include "core/base/random.h"
#include "core/geometry/motion.h"
#include "core/geometry/point.h"

namespace shapedb::testing_support {

inline PointCloud shuffled(PointCloud points, std::uint64_t seed) {
    Random random(seed);
    for (std::size_t i = points.size(); i > 1; --i) std::swap(points[i - 1], points[random.below(i)]);
    return points;
}

/// Turn 0 to `turns` - 1: rotation or reflection, scale 1e-6 to 1e6, a translation of up to ten diameters.
inline Motion anyMotion(Random& random, int turn, int turns) {
    Motion motion;
    motion.rotation = randomRotation(random);
    motion.scale = std::pow(10.0, -6.0 + 12.0 * turn / (turns - 1));
    motion.reflected = turn % 2 == 1;
    if (motion.reflected) {
        for (auto& row : motion.rotation) row[2] = -row[2];
    }
    const double reach = 30.0 * motion.scale;
    motion.translation = {random.uniform(-reach, reach), random.uniform(-reach, reach),
                          random.uniform(-reach, reach)};
    return motion;
}

}  // namespace shapedb::testing_support
