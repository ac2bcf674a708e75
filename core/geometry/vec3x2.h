// SPDX-License-Identifier: GPL-3.0-or-later
// Two points in SIMD lanes: the operations of point.h on both at once, with the same bits for each.
#pragma once

#include "core/base/double2.h"
#include "core/geometry/point.h"

namespace shapedb {

struct Vec3x2 {
    Double2 x;
    Double2 y;
    Double2 z;

    Vec3x2() = default;
    Vec3x2(Double2 px, Double2 py, Double2 pz) : x(px), y(py), z(pz) {}
    Vec3x2(const Point3& a, const Point3& b) : x(a.x, b.x), y(a.y, b.y), z(a.z, b.z) {}

    Point3 low() const { return {x.low(), y.low(), z.low()}; }
    Point3 high() const { return {x.high(), y.high(), z.high()}; }
};

inline Vec3x2 operator+(const Vec3x2& a, const Vec3x2& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Vec3x2 operator-(const Vec3x2& a, const Vec3x2& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Vec3x2 operator*(Double2 s, const Vec3x2& a) { return {s * a.x, s * a.y, s * a.z}; }

inline Double2 dot(const Vec3x2& a, const Vec3x2& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Vec3x2 cross(const Vec3x2& a, const Vec3x2& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline Double2 squaredLength(const Vec3x2& a) { return dot(a, a); }
inline Double2 length(const Vec3x2& a) { return sqrt(squaredLength(a)); }

}  // namespace shapedb
