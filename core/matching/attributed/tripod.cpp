// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/matching/attributed/tripod.h"

#include <cmath>

namespace shapedb {

bool tripod(const Point3& first, const Point3& second, Tripod& out) {
    const double size = length(first);
    if (size < kShortestDirection) return false;
    out[0] = (1.0 / size) * first;
    const Point3 across = second - dot(second, out[0]) * out[0];
    const double off = length(across);
    if (off < kShortestDirection) return false;
    out[1] = (1.0 / off) * across;
    out[2] = cross(out[0], out[1]);
    return true;
}

Matrix3 tripodMap(const Tripod& from, const Tripod& to, bool reflected) {
    const double sign = reflected ? -1.0 : 1.0;
    const auto row = [&](double x, double y, double z) {
        const Point3 r = x * from[0] + y * from[1] + (sign * z) * from[2];
        return std::array<double, 3>{r.x, r.y, r.z};
    };
    return {row(to[0].x, to[1].x, to[2].x), row(to[0].y, to[1].y, to[2].y), row(to[0].z, to[1].z, to[2].z)};
}

}  // namespace shapedb
