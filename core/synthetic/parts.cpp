// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/synthetic/parts.h"

#include <cmath>

namespace shapedb {

namespace {

SolidPart place(SolidShape shape, const Point3& centre, const Matrix3& axes) {
    Motion placement;
    placement.rotation = axes;
    placement.translation = centre;
    return {shape, placement};
}

}  // namespace

Matrix3 rotationFromZ(const Point3& to) {
    const Point3 z = (1.0 / length(to)) * to;
    // Any direction not close to z completes the frame.
    const Point3 other = std::abs(z.x) < 0.6 ? Point3{1.0, 0.0, 0.0} : Point3{0.0, 1.0, 0.0};
    const Point3 across = cross(other, z);
    const Point3 y = (1.0 / length(across)) * across;
    const Point3 x = cross(y, z);
    return {{{x.x, y.x, z.x}, {x.y, y.y, z.y}, {x.z, y.z, z.z}}};
}

SolidPart ball(const Point3& centre, double radius) {
    return place(SolidSphere{radius}, centre, Motion{}.rotation);
}

SolidPart ellipsoid(const Point3& centre, const Point3& semiAxes, const Matrix3& axes) {
    return place(SolidEllipsoid{semiAxes}, centre, axes);
}

SolidPart block(const Point3& centre, const Point3& halfSides, const Matrix3& axes) {
    return place(SolidBox{halfSides}, centre, axes);
}

SolidPart rod(const Point3& from, const Point3& to, double radius) {
    return place(SolidCapsule{radius, 0.5 * distance(from, to)}, 0.5 * (from + to), rotationFromZ(to - from));
}

SolidPart cylinder(const Point3& from, const Point3& to, double radius, double innerRadius) {
    return place(SolidTube{radius, 0.5 * distance(from, to), innerRadius}, 0.5 * (from + to),
                 rotationFromZ(to - from));
}

SolidPart ring(const Point3& centre, const Point3& axis, double ringRadius, double tubeRadius) {
    return place(SolidTorus{ringRadius, tubeRadius}, centre, rotationFromZ(axis));
}

}  // namespace shapedb
