// SPDX-License-Identifier: GPL-3.0-or-later
// The ball of a cell in double precision, cached beside the cell. It nearly always tells whether a point lies
// inside, with a fraction of the arithmetic of sideOfSphere and without reading the cell's corners. Within a
// proven margin of the sphere it says "unknown", and the exact predicate decides.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "core/base/double2.h"
#include "core/delaunay/predicates.h"

namespace shapedb {

/// Centre and squared radius. With kNoBall as squared radius everything is unknown.
struct alignas(32) DelaunayBall {
    double x;
    double y;
    double z;
    double squaredRadius;
};

constexpr double kNoBall = std::numeric_limits<double>::quiet_NaN();

/// The vector from one point to another and its squared length.
struct Offset {
    double x = 0.0;
    double y = 0.0;
    double z = 0.0;
    double squared = 0.0;
};

[[nodiscard]] inline Offset offsetTo(const Site& from, const Site& to) {
    const double x = to.x - from.x, y = to.y - from.y, z = to.z - from.z;
    return {x, y, z, x * x + y * y + z * z};
}

/// What ballsContain compares is off by less than a fifth of this share of the squares compared; the proof is
/// in ballsThrough.
constexpr double kBallMargin = 1e-8;

/// What two balls say about a point, bit 0 for the first and bit 1 for the second.
struct Containment {
    unsigned inside;   ///< the point is strictly inside, for certain
    unsigned unknown;  ///< it may be inside, outside or on the sphere
};

[[nodiscard]] inline Containment ballsContain(const DelaunayBall& a, const DelaunayBall& b, const Site& p) {
    const Double2 x = Double2(a.x, b.x) - p.x, y = Double2(a.y, b.y) - p.y, z = Double2(a.z, b.z) - p.z;
    const Double2 squaredRadius(a.squaredRadius, b.squaredRadius);
    const Double2 squared = x * x + y * y + z * z;
    const Double2 within = squaredRadius - squared;
    const Double2 margin = Double2(kBallMargin) * (squaredRadius + squared);
    const unsigned inside = less(margin, within);
    const unsigned outside = less(within, Double2(0.0) - margin);
    return {inside, ~(inside | outside) & 3u};  // comparisons with NaN are false: unknown
}

/// Two sets of three offsets from one point, side by side.
struct Offsets2 {
    std::array<Double2, 3> x;
    std::array<Double2, 3> y;
    std::array<Double2, 3> z;
    std::array<Double2, 3> squared;

    Offsets2(const std::array<const Offset*, 3>& first, const std::array<const Offset*, 3>& second) {
        for (std::size_t i = 0; i < 3; ++i) {
            x[i] = {first[i]->x, second[i]->x};
            y[i] = {first[i]->y, second[i]->y};
            z[i] = {first[i]->z, second[i]->z};
            squared[i] = {first[i]->squared, second[i]->squared};
        }
    }
};

/// Two balls: each has p, and the three points at its offsets from p, on its sphere. A ball that would not be
/// accurate enough gets kNoBall as its radius.
inline void ballsThrough(const Site& p, const Offsets2& w, DelaunayBall& first, DelaunayBall& second) {
    // Proof of the margin. Let u = 2^-53, a, b, c the offsets from p, R the radius and S = |a| |b| |c|.
    //  - A cross product is off by at most 6 u |b| |c|, so the determinant by 12 u S, and the centre as seen
    //    from p, since no offset is longer than 2 R, by (40 u S / det + 12 u S / det) R. `accurate` demands
    //    S / det < 1e5, which makes that 6e-10 R.
    //  - Adding p rounds each coordinate of the centre by u times its size. `accurate` demands
    //    R > 1e-6 max |p_i|, so that size is at most about 1e6 R, and the centre moves by 2e-10 R.
    //  - A centre off by d moves what ballsContain compares, for a point q, by at most 2 |p - q| d, less than
    //    2e-9 of the sum of the squares: a fifth of kBallMargin.
    // The bound on the determinant itself keeps all of this clear of underflow.
    constexpr double kMinSquaredFlatness = 1e-10;
    constexpr double kMinSquaredDeterminant = 1e-200;
    constexpr double kMinSquaredNearness = 1e-12;
    const auto& [x, y, z, squared] = w;
    const Double2 bcx = y[1] * z[2] - z[1] * y[2], bcy = z[1] * x[2] - x[1] * z[2],
                  bcz = x[1] * y[2] - y[1] * x[2];
    const Double2 cax = y[2] * z[0] - z[2] * y[0], cay = z[2] * x[0] - x[2] * z[0],
                  caz = x[2] * y[0] - y[2] * x[0];
    const Double2 abx = y[0] * z[1] - z[0] * y[1], aby = z[0] * x[1] - x[0] * z[1],
                  abz = x[0] * y[1] - y[0] * x[1];
    const Double2 det = x[0] * bcx + y[0] * bcy + z[0] * bcz;
    const Double2 half = Double2(0.5) / det;
    const Double2 cx = Double2(p.x) + half * (squared[0] * bcx + squared[1] * cax + squared[2] * abx);
    const Double2 cy = Double2(p.y) + half * (squared[0] * bcy + squared[1] * cay + squared[2] * aby);
    const Double2 cz = Double2(p.z) + half * (squared[0] * bcz + squared[1] * caz + squared[2] * abz);
    const Double2 fromX = cx - p.x, fromY = cy - p.y, fromZ = cz - p.z;
    const Double2 squaredRadius = fromX * fromX + fromY * fromY + fromZ * fromZ;
    const double reach = max3(std::abs(p.x), std::abs(p.y), std::abs(p.z));
    const unsigned accurate =
        less(Double2(kMinSquaredFlatness) * squared[0] * squared[1] * squared[2], det * det) &
        less(kMinSquaredDeterminant, det * det) & less(kMinSquaredNearness * reach * reach, squaredRadius);
    first = {cx.low(), cy.low(), cz.low(), (accurate & 1u) != 0 ? squaredRadius.low() : kNoBall};
    second = {cx.high(), cy.high(), cz.high(), (accurate & 2u) != 0 ? squaredRadius.high() : kNoBall};
}

}  // namespace shapedb
