// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/fit/free_axes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "core/base/math.h"

namespace shapedb {

namespace {

// No small rotational symmetry has all of these angles.
constexpr std::array<double, 6> kProbedDegrees = {20.0, 47.0, 90.0, 133.0, 180.0, 255.0};
constexpr double kUnchanged = 0.93;  // of the score
constexpr std::size_t kProbePoints = 384;
constexpr float kProbeWidth =
    0.05f;  // share of the query's diagonal: wide, since turned poses are not refined

constexpr int kTurnSteps = 72;

}  // namespace

Motion turnedAbout(const TurnAxis& axis, double angle, const Motion& pose) {
    Motion turn;
    turn.rotation = rotationAbout(axis.direction, angle);
    turn.translation = axis.point - rotate(turn.rotation, axis.point);
    return compose(turn, pose);
}

std::array<TurnAxis, 3> axesOf(const Comparison& comparison, const Motion& pose) {
    const Point3 point = apply(pose, comparison.other().mean);
    return {{{point, rotate(pose.rotation, {1.0, 0.0, 0.0})},
             {point, rotate(pose.rotation, {0.0, 1.0, 0.0})},
             {point, rotate(pose.rotation, {0.0, 0.0, 1.0})}}};
}

std::vector<TurnAxis> freeAxes(Comparison& comparison, const Motion& pose, const FitView& view) {
    const double score = comparison.shares(pose, view, kProbePoints, kProbeWidth).score();
    std::vector<TurnAxis> axes;
    if (!(score > 0.0)) return axes;
    for (const TurnAxis& axis : axesOf(comparison, pose)) {
        const bool free = std::all_of(kProbedDegrees.begin(), kProbedDegrees.end(), [&](double degrees) {
            const Motion turned = turnedAbout(axis, toRadians(degrees), pose);
            return comparison.shares(turned, view, kProbePoints, kProbeWidth).score() >= kUnchanged * score;
        });
        if (free) axes.push_back(axis);
    }
    return axes;
}

bool isTurned(const Comparison& comparison, const Motion& from, const Motion& to,
              const std::vector<TurnAxis>& axes, double apart) {
    if (axes.empty()) return false;
    // Free about two axes is free about all: only the middle has to stay in its place.
    if (axes.size() > 1) {
        return distance(apply(from, comparison.other().mean), apply(to, comparison.other().mean)) < apart &&
               std::abs(from.scale - to.scale) < apart * from.scale;
    }
    for (int step = 0; step < kTurnSteps; ++step) {
        const double angle = 2.0 * kPi * step / kTurnSteps;
        if (comparison.apart(turnedAbout(axes.front(), angle, from), to) < apart) return true;
    }
    return false;
}

}  // namespace shapedb
