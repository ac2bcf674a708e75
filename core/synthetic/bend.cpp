// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/synthetic/bend.h"

#include <algorithm>
#include <cmath>

#include "core/geometry/principal_axes.h"

namespace shapedb {

PointCloud bent(const PointCloud& points, double radians) {
    const Matrix3 axes = principalAxes(points);
    const auto along = [&](std::size_t row, const Point3& p) {
        return axes[row][0] * p.x + axes[row][1] * p.y + axes[row][2] * p.z;
    };
    double low = along(0, points.front());
    double high = low;
    for (const Point3& p : points) {
        low = std::min(low, along(0, p));
        high = std::max(high, along(0, p));
    }
    if (!(high > low)) return points;
    const double radius = (high - low) / radians;
    double middle = 0.0;
    for (const Point3& p : points) middle += along(1, p) / static_cast<double>(points.size());
    PointCloud result;
    result.reserve(points.size());
    for (const Point3& p : points) {
        const double angle = (along(0, p) - 0.5 * (low + high)) / radius;
        const double out = radius - (along(1, p) - middle);
        const double a = out * std::sin(angle);
        const double b = radius - out * std::cos(angle);
        const double c = along(2, p);
        result.push_back({a * axes[0][0] + b * axes[1][0] + c * axes[2][0],
                          a * axes[0][1] + b * axes[1][1] + c * axes[2][1],
                          a * axes[0][2] + b * axes[1][2] + c * axes[2][2]});
    }
    return result;
}

}  // namespace shapedb
