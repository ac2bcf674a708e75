// SPDX-License-Identifier: GPL-3.0-or-later
// Arithmetic that every scorer shares: the weight of a distance, and what keeps bounds safe after rounding.
#pragma once

#include <algorithm>
#include <cmath>

namespace shapedb {

/// How much two points at this squared distance count, [0, 1]: (1 - d^2 / (8 width^2))^4, and 0 beyond
/// 2.83 widths. Close to a Gaussian of standard deviation `width`, without the exponential.
[[nodiscard]] inline double kernel(double squaredDistance, double width) {
    const double t = 1.0 - squaredDistance / (8.0 * width * width);
    if (t <= 0.0) return 0.0;
    const double t2 = t * t;
    return t2 * t2;
}

/// How near two points at heights (or radii) x and y can be brought by a motion that keeps these: a
/// lower bound of |x - y| that still holds after rounding.
[[nodiscard]] inline double leastGap(double x, double y) {
    constexpr double kRounding = 1e-14;  // some fifty times that of a rotation
    return std::max(0.0, std::abs(x - y) - kRounding * (std::abs(x) + std::abs(y)));
}

/// Bounds are raised by this factor: room for the rounding of sums taken in another order.
constexpr double kBoundMargin = 1.0 + 1e-12;

/// Only a shape compared with itself scores 1; any other scores less, however similar.
[[nodiscard]] inline double belowOne(double score) { return std::min(score, std::nextafter(1.0, 0.0)); }

}  // namespace shapedb
