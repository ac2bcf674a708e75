// SPDX-License-Identifier: Apache-2.0
// Pi, and angles in degrees and radians.
#pragma once

namespace shapedb {

constexpr double kPi = 3.14159265358979323846;
constexpr double kRadiansPerDegree = kPi / 180.0;

[[nodiscard]] constexpr double toRadians(double degrees) { return degrees * kRadiansPerDegree; }
[[nodiscard]] constexpr double toDegrees(double radians) { return radians * 180.0 / kPi; }

}  // namespace shapedb
