// How a cloud of points spreads over the directions, shell by shell around its centroid:
// rotation-invariant energies of spherical harmonics (Kazhdan, Funkhouser, Rusinkiewicz 2003).
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "core/geometry/point.h"

namespace shapedb {

constexpr std::size_t kShells = 8;   ///< out to twice the mean radius; farther points count for the last
constexpr std::size_t kDegrees = 8;  ///< 1 to 8; degree 0 is the radii alone, which others tell

/// By shell, then degree: the root of the energy of that degree, scaled so that all points in one
/// direction of one shell would give 1. In [0, 1].
using ShellEnergies = std::array<double, kShells * kDegrees>;

/// At least one point. `weights` as many, none below 0, their sum above 0; or empty: all equal. All at
/// one place: all 0.
[[nodiscard]] ShellEnergies shellHarmonics(const PointCloud& points, const std::vector<double>& weights = {});

}  // namespace shapedb
