// SPDX-License-Identifier: GPL-3.0-or-later
// Shorthands for placing primitives; for the sources of this folder.
#pragma once

#include "core/geometry/motion.h"
#include "core/synthetic/solid.h"

namespace shapedb {

/// A rotation that takes the z axis to the direction of `to` (not zero); the roll is arbitrary.
[[nodiscard]] Matrix3 rotationFromZ(const Point3& to);

/// Rotations by `angle` radians, counter-clockwise as seen from the tip of the axis.
[[nodiscard]] inline Matrix3 rotationAboutX(double angle) { return rotationAboutAxis(0, angle); }
[[nodiscard]] inline Matrix3 rotationAboutY(double angle) { return rotationAboutAxis(1, angle); }
[[nodiscard]] inline Matrix3 rotationAboutZ(double angle) { return rotationAboutAxis(2, angle); }

[[nodiscard]] SolidPart ball(const Point3& centre, double radius);
[[nodiscard]] SolidPart ellipsoid(const Point3& centre, const Point3& semiAxes,
                                  const Matrix3& axes = Motion{}.rotation);
[[nodiscard]] SolidPart block(const Point3& centre, const Point3& halfSides,
                              const Matrix3& axes = Motion{}.rotation);

/// A capsule with the given ends of its axis, which must differ.
[[nodiscard]] SolidPart rod(const Point3& from, const Point3& to, double radius);

/// A cylinder with flat ends, a pipe when `innerRadius` is above 0.
[[nodiscard]] SolidPart cylinder(const Point3& from, const Point3& to, double radius,
                                 double innerRadius = 0.0);

/// A torus about `axis`.
[[nodiscard]] SolidPart ring(const Point3& centre, const Point3& axis, double ringRadius, double tubeRadius);

}  // namespace shapedb
