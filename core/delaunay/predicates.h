// The two questions a Delaunay triangulation asks of points, answered exactly: which side of a plane,
// which side of a sphere. The quick answer is inline; what it leaves open goes to CGAL.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "core/geometry/point.h"

namespace shapedb {

/// A point that fills half a cache line, so that reading one never touches two.
struct alignas(32) Site {
    double x = 0.0;
    double y = 0.0;
    double z = 0.0;
    std::uint64_t mark = 0;  ///< scratch of whoever inserts around this site
};

inline bool samePlace(const Site& a, const Site& b) { return a.x == b.x && a.y == b.y && a.z == b.z; }

// std::max of a list compares with branches, which these values make unpredictable.
inline double most(double a, double b, double c) { return std::max(std::max(a, b), c); }
inline double least(double a, double b, double c) { return std::min(std::min(a, b), c); }

/// What follows is exact but slow: 1, 0 or -1, from CGAL's kernel.
[[nodiscard]] int exactOrientation(const Site& a, const Site& b, const Site& c, const Site& d);
[[nodiscard]] int exactSideOfSphere(const Site& a, const Site& b, const Site& c, const Site& d,
                                    const Site& p);
/// p on the circle through a, b and c, all four in one plane: 1 inside, -1 outside, symbolically
/// perturbed as below, never 0.
[[nodiscard]] int sideOfCircle(const Site& a, const Site& b, const Site& c, const Site& p);
/// The symbolic perturbation for a p exactly on the sphere of a, b, c and d. As in CGAL (Devillers and
/// Teillaud, "Perturbations for Delaunay and weighted Delaunay 3D triangulations", 2011), so that both
/// give the same tetrahedra.
[[nodiscard]] int perturbedSideOfSphere(const Site& a, const Site& b, const Site& c, const Site& d,
                                        const Site& p);

/// Sign of det(b - a, c - a, d - a). The error bounds here and below are those of CGAL's semi-static
/// filters (Melquiond and Pion, "Formally certified floating-point filters for homogeneous geometric
/// predicates", 2007), for exactly these orders of operations.
[[nodiscard]] inline int orientation(const Site& a, const Site& b, const Site& c, const Site& d) {
    const double bx = b.x - a.x, by = b.y - a.y, bz = b.z - a.z;
    const double cx = c.x - a.x, cy = c.y - a.y, cz = c.z - a.z;
    const double dx = d.x - a.x, dy = d.y - a.y, dz = d.z - a.z;
    const double bc = bx * cy - cx * by;
    const double bd = bx * dy - dx * by;
    const double cd = cx * dy - dx * cy;
    const double det = bc * dz - bd * cz + cd * bz;
    const double mx = most(std::abs(bx), std::abs(cx), std::abs(dx));
    const double my = most(std::abs(by), std::abs(cy), std::abs(dy));
    const double mz = most(std::abs(bz), std::abs(cz), std::abs(dz));
    const double bound = 5.1107127829973299e-15 * mx * my * mz;
    // Guards against underflow and overflow of the products.
    if (least(mx, my, mz) >= 1e-97 && most(mx, my, mz) < 1e102) {
        if (det > bound) return 1;
        if (det < -bound) return -1;
    }
    return exactOrientation(a, b, c, d);
}

/// 1 when p lies inside the sphere through a, b, c and d (positively oriented), -1 outside, never 0:
/// points on the sphere are perturbed.
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
    // Rows a, c, b, d: CGAL's order.
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
    const double widest = most(mx, my, mz);
    const double bound = 1.2466136531027298e-13 * mx * my * mz * (widest * widest);
    if (least(mx, my, mz) >= 1e-58 && widest < 1e61) {
        if (det > bound) return 1;
        if (det < -bound) return -1;
    }
    const int side = exactSideOfSphere(a, b, c, d, p);
    return side != 0 ? side : perturbedSideOfSphere(a, b, c, d, p);
}

}  // namespace shapedb
