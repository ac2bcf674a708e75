// SPDX-License-Identifier: Apache-2.0
// Axis-aligned boxes.
#pragma once

#include <algorithm>
#include <cmath>

#include "core/geometry/point.h"

namespace shapedb {

/// low <= high on every axis; the default is empty, and adding to it gives what was added.
struct Box {
    Point3 low{INFINITY, INFINITY, INFINITY};
    Point3 high{-INFINITY, -INFINITY, -INFINITY};

    void add(const Box& other) {
        low = {std::min(low.x, other.low.x), std::min(low.y, other.low.y), std::min(low.z, other.low.z)};
        high = {std::max(high.x, other.high.x), std::max(high.y, other.high.y),
                std::max(high.z, other.high.z)};
    }
    void add(const Point3& p) { add({p, p}); }

    Point3 extent() const { return high - low; }
    double diagonal() const { return length(extent()); }
};

/// The smallest box that holds all points.
inline Box boxOf(const PointCloud& points) {
    Box box;
    for (const Point3& p : points) box.add(p);
    return box;
}

}  // namespace shapedb
