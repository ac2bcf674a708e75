// SPDX-License-Identifier: GPL-3.0-or-later
// The two exact predicates of a Delaunay triangulation: on which side of a plane, and of a sphere, is a
// point? An inline floating-point filter answers almost always; what it leaves open goes to CGAL's exact
// kernel.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "core/geometry/point.h"

namespace shapedb {

/// A point to triangulate. Fills half a cache line, so that reading one never touches two.
struct alignas(32) Site {
    double x = 0.0;
    double y = 0.0;
    double z = 0.0;
    std::uint64_t mark = 0;  ///< scratch of the inserter that owns this site (BowyerWatson::numberCorners)
};

inline bool samePlace(const Site& a, const Site& b) { return a.x == b.x && a.y == b.y && a.z == b.z; }

// Branch-free, unlike std::max of a list: which of these values is the largest is unpredictable.
inline double max3(double a, double b, double c) { return std::max(std::max(a, b), c); }
inline double min3(double a, double b, double c) { return std::min(std::min(a, b), c); }

/// Without the filter, from CGAL's kernel: 1, 0 or -1. Slow.
[[nodiscard]] int exactOrientation(const Site& a, const Site& b, const Site& c, const Site& d);
[[nodiscard]] int exactSideOfSphere(const Site& a, const Site& b, const Site& c, const Site& d,
                                    const Site& p);
/// Four points in one plane: 1 when p lies inside the circle through a, b and c, -1 outside. Never 0: a p on
/// the circle is perturbed as below.
[[nodiscard]] int sideOfCircle(const Site& a, const Site& b, const Site& c, const Site& p);
/// For a p exactly on the sphere through a, b, c and d: on which side it ends up when all points are
/// perturbed symbolically, 1 or -1. The same perturbation as CGAL's (Devillers and Teillaud, "Perturbations
/// for Delaunay and weighted Delaunay 3D triangulations", 2011), so both give the same tetrahedra.
[[nodiscard]] int perturbedSideOfSphere(const Site& a, const Site& b, const Site& c, const Site& d,
                                        const Site& p);

// The error bounds of both filters are those of CGAL's semi-static ones (Melquiond and Pion, "Formally
// certified floating-point filters for homogeneous geometric predicates", 2007). They hold for exactly this
// order of operations, and cover neither underflow nor overflow of the products: hence the least and the most
// that coordinate differences may be.
inline constexpr double kOrientationError = 5.1107127829973299e-15;
inline constexpr double kOrientationLeast = 1e-97;
inline constexpr double kOrientationMost = 1e102;
inline constexpr double kSphereError = 1.2466136531027298e-13;
inline constexpr double kSphereLeast = 1e-58;
inline constexpr double kSphereMost = 1e61;

/// The sign of det(b - a, c - a, d - a): 1, 0 or -1.
[[nodiscard]] inline int orientation(const Site& a, const Site& b, const Site& c, const Site& d) {
    const double bx = b.x - a.x, by = b.y - a.y, bz = b.z - a.z;
    const double cx = c.x - a.x, cy = c.y - a.y, cz = c.z - a.z;
    const double dx = d.x - a.x, dy = d.y - a.y, dz = d.z - a.z;
    const double bc = bx * cy - cx * by;
    const double bd = bx * dy - dx * by;
    const double cd = cx * dy - dx * cy;
    const double det = bc * dz - bd * cz + cd * bz;
    const double mx = max3(std::abs(bx), std::abs(cx), std::abs(dx));
    const double my = max3(std::abs(by), std::abs(cy), std::abs(dy));
    const double mz = max3(std::abs(bz), std::abs(cz), std::abs(dz));
    const double bound = kOrientationError * mx * my * mz;
    if (min3(mx, my, mz) >= kOrientationLeast && max3(mx, my, mz) < kOrientationMost) {
        if (det > bound) return 1;
        if (det < -bound) return -1;
    }
    return exactOrientation(a, b, c, d);
}

/// 1 when p lies inside the sphere through a, b, c and d (positively oriented), -1 outside. Never 0: a p on
/// the sphere is perturbed.
[[nodiscard]] inline int sideOfSphere(const Site& a, const Site& b, const Site& c, const Site& d,
                                      const Site& p) {
    const double ax = a.x - p.x, ay = a.y - p.y, az = a.z - p.z;
    const double bx = b.x - p.x, by = b.y - p.y, bz = b.z - p.z;
    const double cx = c.x - p.x, cy = c.y - p.y, cz = c.z - p.z;
    const double dx = d.x - p.x, dy = d.y - p.y, dz = d.z - p.z;
    const double aw = ax * ax + ay * ay + az * az;
    const double bw = bx * bx + by * by + bz * bz;
    const double cw = cx * cx + cy * cy + cz * cz;
    const double dw = dx * dx + dy * dy + dz * dz;
    // Rows in CGAL's order: a, c, b, d.
    const double ac = cx * ay - ax * cy;
    const double ab = bx * ay - ax * by;
    const double ad = dx * ay - ax * dy;
    const double cb = bx * cy - cx * by;
    const double cd = dx * cy - cx * dy;
    const double bd = dx * by - bx * dy;
    const double acb = cb * az - ab * cz + ac * bz;
    const double acd = cd * az - ad * cz + ac * dz;
    const double abd = bd * az - ad * bz + ab * dz;
    const double cbd = bd * cz - cd * bz + cb * dz;
    const double det = cbd * aw - abd * cw + acd * bw - acb * dw;
    const double mx = std::max(std::max(std::abs(ax), std::abs(bx)), std::max(std::abs(cx), std::abs(dx)));
    const double my = std::max(std::max(std::abs(ay), std::abs(by)), std::max(std::abs(cy), std::abs(dy)));
    const double mz = std::max(std::max(std::abs(az), std::abs(bz)), std::max(std::abs(cz), std::abs(dz)));
    const double widest = max3(mx, my, mz);
    const double bound = kSphereError * mx * my * mz * (widest * widest);
    if (min3(mx, my, mz) >= kSphereLeast && widest < kSphereMost) {
        if (det > bound) return 1;
        if (det < -bound) return -1;
    }
    const int side = exactSideOfSphere(a, b, c, d, p);
    return side != 0 ? side : perturbedSideOfSphere(a, b, c, d, p);
}

}  // namespace shapedb
