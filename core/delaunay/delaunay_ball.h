// The ball of a cell as doubles give it, which most often tells whether it holds a point. Quicker than
// the determinant of predicates.h, and of the cell's corners it needs none.
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

/// Centre and squared radius. A NaN for the latter: the ball says nothing.
struct alignas(32) DelaunayBall {
    double x;
    double y;
    double z;
    double squaredRadius;
};

constexpr double kNoBall = std::numeric_limits<double>::quiet_NaN();

/// From a point to another and its squared length.
struct Way {
    double x = 0.0;
    double y = 0.0;
    double z = 0.0;
    double squared = 0.0;
};

[[nodiscard]] inline Way wayTo(const Site& from, const Site& to) {
    const double x = to.x - from.x, y = to.y - from.y, z = to.z - from.z;
    return {x, y, z, x * x + y * y + z * z};
}

/// The share of the squares in the comparison of ballsHold that their errors may reach. See ballsThrough.
constexpr double kBallSlack = 1e-8;

/// What two balls say about a point; bit 0 or 1 for each.
struct Held {
    unsigned surely;   ///< the ball holds the point
    unsigned unknown;  ///< it may hold it, or have it on its sphere
};

[[nodiscard]] inline Held ballsHold(const DelaunayBall& a, const DelaunayBall& b, const Site& p) {
    const Double2 x = Double2(a.x, b.x) - p.x, y = Double2(a.y, b.y) - p.y, z = Double2(a.z, b.z) - p.z;
    const Double2 squaredRadius(a.squaredRadius, b.squaredRadius);
    const Double2 squared = x * x + y * y + z * z;
    const Double2 within = squaredRadius - squared;
    const Double2 slack = Double2(kBallSlack) * (squaredRadius + squared);
    const unsigned surely = less(slack, within);
    const unsigned surelyNot = less(within, Double2(0.0) - slack);
    return {surely, ~(surely | surelyNot) & 3u};
}

/// Three ways from a point, and three others from it.
struct Ways2 {
    std::array<Double2, 3> x;
    std::array<Double2, 3> y;
    std::array<Double2, 3> z;
    std::array<Double2, 3> squared;

    Ways2(const std::array<const Way*, 3>& first, const std::array<const Way*, 3>& second) {
        for (std::size_t i = 0; i < 3; ++i) {
            x[i] = {first[i]->x, second[i]->x};
            y[i] = {first[i]->y, second[i]->y};
            z[i] = {first[i]->z, second[i]->z};
            squared[i] = {first[i]->squared, second[i]->squared};
        }
    }
};

/// The balls with p and the ends of three ways from p on their spheres, for two times three; without a
/// radius where they would not be accurate enough.
///
/// With u = 2^-53, R the radius and S = |a| |b| |c|: the cross products are off by 6 u |b| |c|, so the
/// determinant by 12 u S and the centre seen from p, whose ways are at most 2 R long, by
/// (40 u S / det + 12 u S / det) R. Flatness is limited so that S / det < 1e5, which makes 6e-10 R. The
/// centre is rounded at a place that is at most 1e6 R from the origin: 2e-10 R. A centre off by d moves
/// what ballsHold compares by 2 |p - q| d, less than 2e-9 of the sum of the squares, a fifth of
/// kBallSlack. The limits on the determinant keep all of it clear of underflow.
inline void ballsThrough(const Site& p, const Ways2& w, DelaunayBall& first, DelaunayBall& second) {
    constexpr double kSquaredFlatness = 1e-10;
    constexpr double kLeastSquaredDeterminant = 1e-200;
    constexpr double kSquaredNearness = 1e-12;
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
    const double reach = most(std::abs(p.x), std::abs(p.y), std::abs(p.z));
    const unsigned accurate =
        less(Double2(kSquaredFlatness) * squared[0] * squared[1] * squared[2], det * det) &
        less(kLeastSquaredDeterminant, det * det) & less(kSquaredNearness * reach * reach, squaredRadius);
    first = {cx.low(), cy.low(), cz.low(), (accurate & 1u) != 0 ? squaredRadius.low() : kNoBall};
    second = {cx.high(), cy.high(), cz.high(), (accurate & 2u) != 0 ? squaredRadius.high() : kNoBall};
}

}  // namespace shapedb
