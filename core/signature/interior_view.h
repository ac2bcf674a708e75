// The interior of a segmented shape as its statistics want it: in its own frame and unit, with
// points drawn from the interior and from the surface.
#pragma once

#include <cstdint>
#include <vector>

#include "core/geometry/point.h"
#include "core/segmentation/segmentation.h"

namespace shapedb {

/// All coordinates: origin at the centroid of the interior, axes along its principal axes by
/// falling spread (signs open), lengths in units of Segmentation::size.
struct InteriorView {
    PointCloud sites;  ///< all sites of the segmentation

    // One entry an interior tetrahedron; `neighbours` holds indices into the same arrays.
    std::vector<std::array<std::uint32_t, 4>> vertices;    ///< indices of `sites`
    std::vector<std::array<std::uint32_t, 4>> neighbours;  ///< kNoTetrahedron: none, or outside
    std::vector<double> volumes;
    PointCloud centroids;
    std::vector<double> radii;  ///< circumradii: the local thickness; at most 1
    double volume = 0.0;        ///< sum of `volumes`

    PointCloud inner;                       ///< kSamples points evenly spread over the interior
    std::vector<std::uint32_t> innerOwner;  ///< the tetrahedron each lies in
    PointCloud surface;                     ///< the sites the interior touches

    double meanSurfaceDistance = 0.0;  ///< between two points of `surface`, by kPairs draws
    double meanRadius = 0.0;           ///< of the interior's matter, from the origin

    static constexpr std::size_t kSamples = 2048;
    static constexpr std::size_t kPairs = 400000;
};

/// Deterministic: the same segmentation gives the same view. The draws follow the order of the
/// tetrahedra, so a turned scan gives other points of the same distribution.
[[nodiscard]] InteriorView interiorView(const Segmentation& segmentation);

}  // namespace shapedb
