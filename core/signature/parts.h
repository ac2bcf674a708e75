// The weighted points of a signature as the attributed score compares them: in the frame of the
// whole body, with the attributes of their segments in logarithms.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "core/geometry/motion.h"
#include "core/geometry/point.h"

namespace shapedb {

struct SignaturePoint;

/// One segment. Lengths in units of Signature::scale.
struct Part {
    std::array<float, 3> position{};  ///< centroid, in the body's frame
    float radius = 0.0f;              ///< distance from the body's centre: length of `position`
    float share = 0.0f;               ///< of the interior's volume, (0, 1]
    /// Base-2 logarithms: the standard deviations of its matter along its principal axes, falling,
    /// and its peak radius. No less than kSmallestLength each.
    std::array<float, 4> size{};
};

/// Smaller lengths are below the noise of any scanner and count as this.
constexpr double kSmallestLength = 1.0 / 1024.0;

/// The parts of a body and its frame: origin at the centroid of all parts, axes along the principal
/// axes of their matter together, by falling spread, right-handed. The signs of the axes, and axes
/// of equal spread, are chance: who compares two bodies must try all.
struct Body {
    std::vector<Part> parts;  ///< in the order of the points
    Point3 centre;            ///< in the coordinates of SignaturePoint::position
    Matrix3 axes{};           ///< rows: the frame's axes in those coordinates
};

/// `points` as in a Signature: at least one, valid. Deterministic.
[[nodiscard]] Body bodyOf(const std::vector<SignaturePoint>& points);

}  // namespace shapedb
