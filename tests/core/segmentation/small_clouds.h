// SPDX-License-Identifier: GPL-3.0-or-later
// Small point clouds on which every stage is compared with a plain reference: random, noisy, and degenerate
// on purpose (grids and cospherical points).
#pragma once

#include <array>
#include <string>
#include <vector>

#include "core/delaunay/delaunay.h"
#include "core/geometry/point.h"

namespace shapedb {

struct SmallCloud {
    std::string name;
    PointCloud points;  ///< distinct, sanitised (unit frame, sorted)
};

/// All of them; computed once.
const std::vector<SmallCloud>& smallClouds();

struct Triangulated {
    std::string name;
    PointCloud points;
    Tetrahedra tetrahedra;
};

/// All small clouds, triangulated once.
const std::vector<Triangulated>& triangulatedClouds();

/// Corners of tetrahedron t.
std::array<Point3, 4> cornersOf(const Triangulated& cloud, std::size_t t);

}  // namespace shapedb
