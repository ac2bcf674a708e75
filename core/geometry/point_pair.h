// Two points side by side, for the same computation on both: the operations of point.h, with the same
// bits for each.
#pragma once

#include "core/base/pair.h"
#include "core/geometry/point.h"

namespace shapedb {

struct PointPair {
    Pair x;
    Pair y;
    Pair z;

    PointPair() = default;
    PointPair(Pair px, Pair py, Pair pz) : x(px), y(py), z(pz) {}
    PointPair(const Point3& a, const Point3& b) : x(a.x, b.x), y(a.y, b.y), z(a.z, b.z) {}

    Point3 low() const { return {x.low(), y.low(), z.low()}; }
    Point3 high() const { return {x.high(), y.high(), z.high()}; }
};

inline PointPair operator+(const PointPair& a, const PointPair& b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
}
inline PointPair operator-(const PointPair& a, const PointPair& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
}
inline PointPair operator*(Pair s, const PointPair& a) { return {s * a.x, s * a.y, s * a.z}; }

inline Pair dot(const PointPair& a, const PointPair& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline PointPair cross(const PointPair& a, const PointPair& b) {
    return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
inline Pair squaredLength(const PointPair& a) { return dot(a, a); }
inline Pair length(const PointPair& a) { return sqrt(squaredLength(a)); }

}  // namespace shapedb
