// SPDX-License-Identifier: GPL-3.0-or-later
// Solids whose volume and balls are known exactly, as ground truth for tests of the segmentation.
#pragma once

#include <string>
#include <vector>

#include "core/geometry/point.h"
#include "core/synthetic/solid.h"

namespace shapedb {

/// A ball that should become a segment of its own.
struct KnownBall {
    Point3 centre;
    double radius = 0.0;

    double volume() const;
};

struct NamedShape {
    std::string name;              ///< snake_case, e.g. "l_shape"
    Solid solid;                   ///< about the origin
    double volume = 0.0;           ///< of the union, in closed form
    std::vector<KnownBall> balls;  ///< in descending order of volume; may be empty
};

/// The unit ball: volume 4/3 pi.
[[nodiscard]] NamedShape makeSphere();

/// Ring radius 1, tube radius 0.35: volume 2 pi^2 R r^2.
[[nodiscard]] NamedShape makeTorus();

/// Sides 2, 1.4 and 1.
[[nodiscard]] NamedShape makeBox();

/// An L of height 0.8, three quarters of a square of side 2. Made of two boxes that share a face, which is
/// not part of the boundary.
[[nodiscard]] NamedShape makeLShape();

/// Unit balls at x = -1.5 and 1.5 on a rod of radius 0.3.
[[nodiscard]] NamedShape makeDumbbell();

/// A ball of radius 0.8 at the origin and, along both directions of each axis, an arm of radius
/// 0.25 that ends in a ball of radius 0.6 at distance 2.4. The first ball listed is the centre.
[[nodiscard]] NamedShape makeJack();

/// All of the above, in this order.
[[nodiscard]] std::vector<NamedShape> namedShapes();

}  // namespace shapedb
