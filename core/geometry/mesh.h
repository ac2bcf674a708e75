// SPDX-License-Identifier: Apache-2.0
// Triangle meshes, with no more than it takes to turn one into a point cloud.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/base/error.h"
#include "core/geometry/point.h"

namespace shapedb {

/// Indices are into `vertices`. The mesh may be open, non-manifold or inconsistently oriented.
struct TriangleMesh {
    PointCloud vertices;
    std::vector<std::array<std::uint32_t, 3>> triangles;
};

/// `count` points, independent and uniform by area. Same mesh, count and seed: same points.
///
/// Errors: kInvalidArgument when count is 0 or a triangle refers to a vertex that does not
/// exist; kNonFiniteCoordinate when a used vertex is not finite (the message names it);
/// kMalformedFile when the triangles have no area at all.
[[nodiscard]] Result<PointCloud> sampleSurface(const TriangleMesh& mesh, std::size_t count,
                                               std::uint64_t seed);

}  // namespace shapedb
