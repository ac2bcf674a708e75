// SPDX-License-Identifier: GPL-3.0-or-later
// The interior of a segmented shape as the statistics need it: in its own frame and unit.
#pragma once

#include <cstdint>
#include <vector>

#include "core/geometry/point.h"
#include "core/segmentation/segmentation.h"

namespace shapedb {

/// Coordinates: origin at the centroid of the interior, axes along its principal axes in descending order of
/// spread (with arbitrary signs), in units of Segmentation::size.
struct InteriorView {
    PointCloud sites;  ///< all sites of the segmentation

    // One entry per interior tetrahedron; `neighbours` are indices into the same arrays.
    std::vector<std::array<std::uint32_t, 4>> vertices;    ///< indices of `sites`
    std::vector<std::array<std::uint32_t, 4>> neighbours;  ///< kNoTetrahedron: none, or outside
    std::vector<double> volumes;
    PointCloud centroids;
    std::vector<double> radii;  ///< circumradii: the local thickness; at most 1
    double volume = 0.0;        ///< sum of `volumes`

    PointCloud surface;  ///< the sites that the interior touches

    double meanSurfaceDistance = 0.0;  ///< between two points of `surface`, over kPairs random pairs
    double meanRadius = 0.0;           ///< of the interior's matter, from the origin

    static constexpr std::size_t kPairs = 400000;
};

/// Deterministic. The pairs depend on the order of the sites, so a turned scan gives other pairs of the same
/// distribution.
[[nodiscard]] InteriorView interiorView(const Segmentation& segmentation);

}  // namespace shapedb
