// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/matching/score_scale.h"

#include <algorithm>
#include <cmath>

namespace shapedb {

namespace {

// The distance, in units of what unrelated shapes differ by, at which the score is 0.5.
constexpr double kHalfWay = 0.5;

}  // namespace

double scoreOfDistance(double distance) noexcept {
    const double d = distance / kHalfWay;
    return 1.0 / (1.0 + d * d);
}

double distanceOfScore(double score) noexcept {
    return score > 0.0 ? kHalfWay * std::sqrt(std::max(0.0, 1.0 / score - 1.0)) : INFINITY;
}

}  // namespace shapedb
