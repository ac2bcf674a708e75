// SPDX-License-Identifier: Apache-2.0
// Similarity motions: rotation or reflection, uniform scale, translation.
#pragma once

#include <array>
#include <cstddef>

#include "core/base/random.h"
#include "core/geometry/point.h"

namespace shapedb {

/// Row-major: `matrix[row][column]`.
using Matrix3 = std::array<std::array<double, 3>, 3>;

/// The map y = scale * R x + t. The functions below expect and keep these invariants:
/// `scale` is finite and above 0, `rotation` (R) is orthonormal, and its
/// determinant is -1 exactly when `reflected`, +1 otherwise. The default is the identity.
struct Motion {
    double scale = 1.0;      ///< ratio of lengths after to before
    bool reflected = false;  ///< whether left and right are swapped
    Matrix3 rotation = {{{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}}};  ///< R
    Point3 translation;  ///< t, in the units of the result
};

/// R v: rotates (and reflects) a direction.
[[nodiscard]] inline Point3 rotate(const Matrix3& rotation, const Point3& v) {
    const auto along = [&](const std::array<double, 3>& row) {
        return row[0] * v.x + row[1] * v.y + row[2] * v.z;
    };
    return {along(rotation[0]), along(rotation[1]), along(rotation[2])};
}

/// a b: first b, then a.
[[nodiscard]] Matrix3 multiply(const Matrix3& a, const Matrix3& b);

[[nodiscard]] Matrix3 transposed(const Matrix3& m);

/// The rotation by `angle`, radians, about a unit vector (Rodrigues).
[[nodiscard]] Matrix3 rotationAbout(const Point3& direction, double angle);

/// The same about a coordinate axis (0 to 2), which is left exactly where it is.
[[nodiscard]] Matrix3 rotationAboutAxis(std::size_t axis, double angle);

/// The determinant of a 3x3 matrix.
[[nodiscard]] double determinant(const Matrix3& m);

/// scale * R p + t.
[[nodiscard]] Point3 apply(const Motion& motion, const Point3& p);

/// `apply` to every point, in order. (Not called `apply`: a std::vector argument would bring in
/// std::apply by argument-dependent lookup.)
[[nodiscard]] PointCloud applyToCloud(const Motion& motion, const PointCloud& points);

/// The motion that undoes `motion`, up to rounding.
[[nodiscard]] Motion inverse(const Motion& motion);

/// First `first`, then `second`: apply(compose(second, first), p) = apply(second, apply(first, p)).
[[nodiscard]] Motion compose(const Motion& second, const Motion& first);

/// A rotation (determinant +1) uniform over SO(3), from a uniform unit quaternion (Shoemake 1992).
/// Advances `random`.
[[nodiscard]] Matrix3 randomRotation(Random& random);

/// Number `i` of `count` unit vectors spread evenly over the sphere: a Fibonacci spiral.
[[nodiscard]] Point3 evenDirection(int i, int count);

/// Some unit vector perpendicular to `direction`, which must not be zero.
[[nodiscard]] Point3 anyPerpendicular(const Point3& direction);

/// A unit vector uniform over the sphere. Advances `random`.
[[nodiscard]] Point3 randomDirection(Random& random);

}  // namespace shapedb
