// Interiors of known form, without a scan: solids of equal cubes, and what the tests of several
// statistics compare them with.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "core/base/random.h"
#include "core/signature/interior_view.h"

namespace shapedb::testing_support {

using Cube = std::array<int, 3>;

/// All cubes with first <= index < last in every direction.
std::vector<Cube> block(const Cube& first, const Cube& last);
std::vector<Cube> together(std::vector<Cube> a, const std::vector<Cube>& b);

/// Two arms of `length` cubes along x, `thick` wide and high, `gap` cubes apart, joined at x = 0.
std::vector<Cube> horseshoe(int length, int thick, int gap);

/// The solid of these cubes, each cut into six tetrahedra that fit those of its neighbours; cubes
/// have side `side`, the centroid is the origin. Turned off the axes, so that no face lies in a
/// plane of coordinates.
InteriorView viewOfCubes(const std::vector<Cube>& cubes, double side);

/// Uniform over tetrahedron t of the view.
Point3 randomPointIn(const InteriorView& view, std::size_t t, Random& random);

/// Weight of `value` in bin `bin` of `count` bins over [low, high]: the share of a triangle of two
/// bins' width whose top is the bin's centre; beyond the outermost centres all belongs to these.
double triangle(double value, double low, double high, std::size_t count, std::size_t bin);

/// The bytes of a histogram of these sums: roots of their shares of the whole.
std::vector<std::uint8_t> levelsOf(const std::vector<double>& sums);

/// Barycentric coordinates of p in tetrahedron t of the view.
std::array<double, 4> barycentric(const InteriorView& view, std::size_t t, const Point3& p);

}  // namespace shapedb::testing_support
