// SPDX-License-Identifier: Apache-2.0
// Points, and the vector operations used everywhere.
#pragma once

#include <array>
#include <cmath>
#include <vector>

namespace shapedb {

/// A point or vector in the units of the scan it comes from.
struct Point3 {
    double x = 0.0;
    double y = 0.0;
    double z = 0.0;
};

/// A point cloud: positions only, in no particular order.
using PointCloud = std::vector<Point3>;

inline Point3 operator+(const Point3& a, const Point3& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Point3 operator-(const Point3& a, const Point3& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Point3 operator*(double s, const Point3& a) { return {s * a.x, s * a.y, s * a.z}; }
inline bool operator==(const Point3& a, const Point3& b) { return a.x == b.x && a.y == b.y && a.z == b.z; }
inline bool operator!=(const Point3& a, const Point3& b) { return !(a == b); }

inline double dot(const Point3& a, const Point3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Point3 cross(const Point3& a, const Point3& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline double squaredLength(const Point3& a) { return dot(a, a); }
inline double length(const Point3& a) { return std::sqrt(squaredLength(a)); }
inline double squaredDistance(const Point3& a, const Point3& b) { return squaredLength(a - b); }
inline double distance(const Point3& a, const Point3& b) { return length(a - b); }
inline bool isFinite(const Point3& a) {
    return std::isfinite(a.x) && std::isfinite(a.y) && std::isfinite(a.z);
}

/// Lexicographic order by x, y, z: a total order on finite points.
inline bool lexicographicLess(const Point3& a, const Point3& b) {
    if (a.x != b.x) return a.x < b.x;
    if (a.y != b.y) return a.y < b.y;
    return a.z < b.z;
}

}  // namespace shapedb
