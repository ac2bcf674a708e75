// SPDX-License-Identifier: GPL-3.0-or-later
// How points are distributed over the directions, shell by shell around their centroid: the
// rotation-invariant energies of spherical harmonics (Kazhdan, Funkhouser, Rusinkiewicz 2003).
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "core/geometry/point.h"

namespace shapedb {

constexpr std::size_t kShells = 8;   ///< out to twice the mean radius; farther points count for the last
constexpr std::size_t kDegrees = 8;  ///< 1 to 8; other statistics cover degree 0, the radii alone

/// By shell, then degree: the square root of the energy, scaled so that all points in one direction of one
/// shell give 1. In [0, 1].
using ShellEnergies = std::array<double, kShells * kDegrees>;

/// `points`: at least one; when all are equal, the result is 0. `weights`: one per point, none negative, with
/// a positive sum; or empty for equal weights.
[[nodiscard]] ShellEnergies shellHarmonics(const PointCloud& points, const std::vector<double>& weights = {});

}  // namespace shapedb
