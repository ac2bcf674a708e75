// SPDX-License-Identifier: GPL-3.0-or-later
// One of the two point sets of a fit, laid out for the loops that compare them. For the sources of this
// folder.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/fit/nearest_grid.h"
#include "core/fit/surface_points.h"
#include "core/geometry/motion.h"

namespace shapedb {

/// The points along their principal axes (longest spread first), about the middle of the box along these
/// axes, with the diagonal of that box as the unit: no coordinate exceeds 0.5.
struct FitPoints {
    explicit FitPoints(const SurfacePoints& surface);

    SurfaceColumns columns;  ///< farthest-point order; filled up to a multiple of eight by repeating
    NearestGrid grid;
    Motion toScan;         ///< from the coordinates above to scan units; a rotation, never a reflection
    Point3 half;           ///< half extents of the box
    float spacing = 0.0f;  ///< mean distance of a point from its nearest neighbour
    Point3 mean;           ///< of the points
    Matrix3 covariance{};  ///< of the points, about their mean
    /// By cell of the grid: 1 where its middle lies in the hull of the points, given by their reach in 80
    /// directions. Empty unless findHull was called.
    std::vector<std::uint8_t> insideHull;

    void findHull();
    std::size_t size() const { return columns.x.size(); }
    /// The first `wanted` points, or all; a multiple of eight.
    std::size_t prefix(std::size_t wanted) const { return wanted < size() ? wanted : size(); }
    /// Mean distance to the nearest neighbour among the first `count`.
    float spacingOf(std::size_t count) const;
};

}  // namespace shapedb
