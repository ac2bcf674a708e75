// Solids as unions of primitives, and points drawn from their boundary: the material of tests
// with analytic answers and of the project's own sample collection.
//
// All functions are pure and may be called from any number of threads at once.
#pragma once

#include <cstddef>
#include <cstdint>
#include <variant>
#include <vector>

#include "core/base/error.h"
#include "core/geometry/motion.h"
#include "core/geometry/point.h"

namespace shapedb {

// The primitives, each closed, centred at the origin of its own frame. All lengths are finite and
// above 0 and in the units of that frame.

/// |p| <= radius.
struct SolidSphere {
    double radius = 1.0;
};

/// Semi-axes along x, y and z.
struct SolidEllipsoid {
    Point3 semiAxes{1.0, 1.0, 1.0};
};

/// A rod with round ends: all points within `radius` of the segment from (0, 0, -halfLength) to
/// (0, 0, halfLength).
struct SolidCapsule {
    double radius = 1.0;
    double halfLength = 1.0;
};

/// A rod with flat ends about the z axis, |z| <= halfLength; with an inner radius above 0 a pipe
/// open at both ends. 0 <= innerRadius < radius.
struct SolidTube {
    double radius = 1.0;
    double halfLength = 1.0;
    double innerRadius = 0.0;
};

/// |x|, |y|, |z| at most half the side.
struct SolidBox {
    Point3 halfSides{1.0, 1.0, 1.0};
};

/// All points within `tubeRadius` of the circle of `ringRadius` about the z axis in the plane
/// z = 0. tubeRadius < ringRadius.
struct SolidTorus {
    double ringRadius = 1.0;
    double tubeRadius = 0.25;
};

using SolidShape = std::variant<SolidSphere, SolidEllipsoid, SolidCapsule, SolidTube, SolidBox, SolidTorus>;

/// A primitive and where it is: the placement takes its own frame to that of the solid.
struct SolidPart {
    SolidShape shape;
    Motion placement;
};

/// The union of its parts. Plain data; `checkSolid` says whether it is usable.
struct Solid {
    std::vector<SolidPart> parts;
};

/// An axis-aligned box, low <= high.
struct SolidBounds {
    Point3 low;
    Point3 high;

    double diagonal() const { return distance(low, high); }
};

/// Errors: kInvalidArgument, naming the part, when the solid has no parts, or a length, scale or
/// translation is outside the range its type documents, or a rotation is not orthonormal.
[[nodiscard]] Result<void> checkSolid(const Solid& solid);

/// Negative inside the part, 0 on its boundary, positive outside; the sign is exact up to
/// rounding, the magnitude is a distance only for sphere, capsule and torus.
[[nodiscard]] double implicitValue(const SolidPart& part, const Point3& p);

/// Whether a point lies in the closed union.
[[nodiscard]] bool contains(const Solid& solid, const Point3& p);

/// The smallest axis-aligned box around the union, exact up to rounding. The solid must have a part.
[[nodiscard]] SolidBounds boundsOf(const Solid& solid);

/// The smallest full thickness of a part: diameter of a rod or tube, wall of a pipe, smallest
/// axis of an ellipsoid, smallest side of a box. In the units of the solid.
[[nodiscard]] double thinnestPart(const Solid& solid);

/// The solid with every part moved.
[[nodiscard]] Solid movedSolid(const Motion& motion, const Solid& solid);

/// `count` points, independent and uniform by area on the boundary of the union, in random order.
///
/// A part is drawn by its area and a point uniformly on it (by rejection for ellipsoid and torus);
/// the point is dropped when the solid goes on just outside of it, and, where the faces of two
/// parts coincide, when an earlier part has that face too. "Just outside" is 1e-9 of the
/// diagonal, so faces that touch or coincide count once or not at all, as they should.
/// Same solid, count and seed: same points.
///
/// Errors: those of `checkSolid`; kInvalidArgument when count is 0, or when less than about a
/// thousandth of the parts' surfaces is on the boundary.
[[nodiscard]] Result<PointCloud> sampleBoundary(const Solid& solid, std::size_t count, std::uint64_t seed);

/// The volume of the union by a quasi-random sequence (Roberts' R3) of `samples` points in the
/// bounding box. Deterministic; at a million samples the error is below 0.2 % for a solid that
/// fills a tenth of its box. `samples` 0 gives 0.
[[nodiscard]] double volumeOf(const Solid& solid, std::size_t samples);

}  // namespace shapedb
