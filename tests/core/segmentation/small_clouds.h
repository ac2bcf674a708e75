// Small point clouds on which every stage is compared with a plain reference: random, noisy, and
// degenerate on purpose (grids and cospherical points). And exact arithmetic for the references.
#pragma once

#include <array>
#include <string>
#include <vector>

#include <CGAL/Exact_rational.h>
#include <CGAL/Simple_cartesian.h>

#include "core/delaunay/delaunay.h"
#include "core/geometry/point.h"

namespace shapedb {

struct SmallCloud {
    std::string name;
    PointCloud points;  ///< distinct, sanitised (unit frame, sorted)
};

/// All of them; computed once.
const std::vector<SmallCloud>& smallClouds();

using ExactNumber = CGAL::Exact_rational;
using ExactKernel = CGAL::Simple_cartesian<ExactNumber>;
using ExactPoint = ExactKernel::Point_3;

/// A cloud with its triangulation and, where many tests ask for them, its exact circumcentres.
struct Triangulated {
    std::string name;
    PointCloud points;
    Tetrahedra tetrahedra;
    std::vector<ExactPoint> centres{};
};

/// All small clouds, triangulated once.
const std::vector<Triangulated>& triangulatedClouds();

inline ExactPoint exact(const Point3& p) { return {p.x, p.y, p.z}; }

/// Corners of tetrahedron t.
std::array<Point3, 4> cornersOf(const Triangulated& cloud, std::size_t t);
std::array<ExactPoint, 4> exactCorners(const Triangulated& cloud, std::size_t t);
ExactPoint exactCentre(const Triangulated& cloud, std::size_t t);

}  // namespace shapedb
