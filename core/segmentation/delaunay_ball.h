// The ball of a cell as doubles give it, which most often tells whether it holds a point. Quicker than
// the determinant of predicates.h, and of the cell's corners it needs none.
#pragma once

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/segmentation/predicates.h"

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

/// The share of the squares in the comparison of ballHolds that their errors may reach. See ballThrough.
constexpr double kBallSlack = 1e-8;

/// 1: the ball surely holds p. -1: it surely does not, nor has it p on its sphere. 0: unknown.
[[nodiscard]] inline int ballHolds(const DelaunayBall& ball, const Site& p) {
    const double x = ball.x - p.x, y = ball.y - p.y, z = ball.z - p.z;
    const double squared = x * x + y * y + z * z;
    const double within = ball.squaredRadius - squared;
    const double slack = kBallSlack * (ball.squaredRadius + squared);
    return static_cast<int>(within > slack) - static_cast<int>(-within > slack);
}

/// The ball with p and the ends of three ways from p on its sphere; without a radius when it would not be
/// accurate enough.
///
/// With u = 2^-53, R the radius and S = |a| |b| |c|: the cross products are off by 6 u |b| |c|, so the
/// determinant by 12 u S and the centre seen from p, whose ways are at most 2 R long, by
/// (40 u S / det + 12 u S / det) R. Flatness is limited so that S / det < 1e5, which makes 6e-10 R. The
/// centre is rounded at a place that is at most 1e6 R from the origin: 2e-10 R. A centre off by d moves
/// what ballHolds compares by 2 |p - q| d, less than 2e-9 of the sum of the squares, a fifth of
/// kBallSlack. The limits on the determinant keep all of it clear of underflow.
[[nodiscard]] inline DelaunayBall ballThrough(const Site& p, const Way& a, const Way& b, const Way& c) {
    constexpr double kSquaredFlatness = 1e-10;
    constexpr double kLeastSquaredDeterminant = 1e-200;
    constexpr double kSquaredNearness = 1e-12;
    const double bcx = b.y * c.z - b.z * c.y, bcy = b.z * c.x - b.x * c.z, bcz = b.x * c.y - b.y * c.x;
    const double cax = c.y * a.z - c.z * a.y, cay = c.z * a.x - c.x * a.z, caz = c.x * a.y - c.y * a.x;
    const double abx = a.y * b.z - a.z * b.y, aby = a.z * b.x - a.x * b.z, abz = a.x * b.y - a.y * b.x;
    const double det = a.x * bcx + a.y * bcy + a.z * bcz;
    const double half = 0.5 / det;
    DelaunayBall ball;
    ball.x = p.x + half * (a.squared * bcx + b.squared * cax + c.squared * abx);
    ball.y = p.y + half * (a.squared * bcy + b.squared * cay + c.squared * aby);
    ball.z = p.z + half * (a.squared * bcz + b.squared * caz + c.squared * abz);
    const double x = ball.x - p.x, y = ball.y - p.y, z = ball.z - p.z;
    const double squaredRadius = x * x + y * y + z * z;
    const double reach = most(std::abs(p.x), std::abs(p.y), std::abs(p.z));
    const bool accurate = det * det > kSquaredFlatness * a.squared * b.squared * c.squared &&
                          det * det > kLeastSquaredDeterminant &&
                          squaredRadius > kSquaredNearness * reach * reach;
    ball.squaredRadius = accurate ? squaredRadius : kNoBall;
    return ball;
}

}  // namespace shapedb
