// SPDX-License-Identifier: GPL-3.0-or-later
// Corners and circumcentres of tetrahedra as rational numbers, for references. Apart from small_clouds.h
// because it includes CGAL, which is slow to compile.
#pragma once

#include <array>

#include <CGAL/Exact_rational.h>
#include <CGAL/Simple_cartesian.h>

#include "tests/core/segmentation/small_clouds.h"

namespace shapedb {

using ExactNumber = CGAL::Exact_rational;
using ExactKernel = CGAL::Simple_cartesian<ExactNumber>;
using ExactPoint = ExactKernel::Point_3;

inline ExactPoint exact(const Point3& p) { return {p.x, p.y, p.z}; }

std::array<ExactPoint, 4> exactCorners(const Triangulated& cloud, std::size_t t);
/// Computed once for each of triangulatedClouds().
ExactPoint exactCentre(const Triangulated& cloud, std::size_t t);

}  // namespace shapedb
