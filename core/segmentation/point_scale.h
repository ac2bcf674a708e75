// How densely the shape is sampled around each point (Section 2).
#pragma once

#include <vector>

#include "core/base/error.h"
#include "core/geometry/point.h"
#include "core/segmentation/delaunay.h"

namespace shapedb {

/// For each point the mean distance to its three nearest other points, in the points' unit.
/// Read off the triangulation: the k-th nearest neighbour of p is adjacent in Del P to p or to
/// one of its k - 1 nearer ones. Linear time.
[[nodiscard]] std::vector<double> pointScales(const PointCloud& points, const Tetrahedra& tetrahedra);

}  // namespace shapedb
