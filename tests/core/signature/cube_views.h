// SPDX-License-Identifier: GPL-3.0-or-later
// Interiors of known form without a scan, made of equal cubes; and reference computations for the tests of
// several statistics.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/base/random.h"
#include "core/signature/interior_view.h"

namespace shapedb::testing_support {

using Cube = std::array<int, 3>;

/// All cubes with first <= index < last in every direction.
std::vector<Cube> cubeBlock(const Cube& first, const Cube& last);
std::vector<Cube> together(std::vector<Cube> a, const std::vector<Cube>& b);

/// Two arms of `length` cubes along x, `thick` wide and high, `gap` cubes apart, joined at x = 0.
std::vector<Cube> horseshoe(int length, int thick, int gap);

/// The solid of these cubes of side `side`, each cut into six tetrahedra that fit those of its neighbours.
/// The centroid is the origin; rotated, so that no face is parallel to a coordinate plane.
InteriorView viewOfCubes(const std::vector<Cube>& cubes, double side);

/// Uniform over tetrahedron t of the view.
Point3 randomPointIn(const InteriorView& view, std::size_t t, Random& random);

/// Weight of `value` in bin `bin` of `count` bins over [low, high]: a triangle function around the bin's
/// centre, two bins wide; values beyond the outermost centres count as these.
double triangle(double value, double low, double high, std::size_t count, std::size_t bin);

/// The levels of a histogram of these sums.
std::vector<std::uint8_t> levelsOf(const std::vector<double>& sums);

/// Barycentric coordinates of p in tetrahedron t of the view.
std::array<double, 4> barycentric(const InteriorView& view, std::size_t t, const Point3& p);

}  // namespace shapedb::testing_support
