// SPDX-License-Identifier: GPL-3.0-or-later
// Frames from two directions, and the orthogonal map between two of them.
#pragma once

#include <array>

#include "core/geometry/motion.h"
#include "core/geometry/point.h"

namespace shapedb {

/// Right-handed, orthonormal.
using Tripod = std::array<Point3, 3>;

/// A vector shorter than this, in units of a body's size, has no reliable direction.
constexpr double kShortestDirection = 1e-3;

/// First axis along `first`, second in the half plane of `second`. False, and `out` undefined, when
/// `first`, or the component of `second` across it, is shorter than kShortestDirection.
[[nodiscard]] bool tripod(const Point3& first, const Point3& second, Tripod& out);

/// Maps each axis of `from` to that of `to`; reflected: the third axis to the opposite.
[[nodiscard]] Matrix3 tripodMap(const Tripod& from, const Tripod& to, bool reflected);

}  // namespace shapedb
