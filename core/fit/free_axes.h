// SPDX-License-Identifier: GPL-3.0-or-later
// Lines about which the other shape may be turned without a change. For the sources of this folder.
#pragma once

#include <array>
#include <vector>

#include "core/fit/comparison.h"
#include "core/geometry/motion.h"

namespace shapedb {

/// In the query's frame.
struct TurnAxis {
    Point3 point;
    Point3 direction;
};

/// The principal axes of the other shape through the mean of its points, where `pose` takes them.
[[nodiscard]] std::array<TurnAxis, 3> axesOf(const Comparison& comparison, const Motion& pose);

/// The principal axes of the other shape, laid on the query by `pose`, about which it can be turned by any
/// angle with hardly any change of the score.
[[nodiscard]] std::vector<TurnAxis> freeAxes(Comparison& comparison, const Motion& pose, const FitView& view);

/// Whether turns about the axes take one pose to within `apart` of the other.
[[nodiscard]] bool isTurned(const Comparison& comparison, const Motion& from, const Motion& to,
                            const std::vector<TurnAxis>& axes, double apart);

/// `pose`, then a turn by `angle` radians about the axis.
[[nodiscard]] Motion turnedAbout(const TurnAxis& axis, double angle, const Motion& pose);

}  // namespace shapedb
