// Triangle meshes, only as far as needed to turn one into a point cloud.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/base/error.h"
#include "core/geometry/point.h"

namespace shapedb {

/// Indices are into `vertices`. Nothing is assumed of orientation, closedness or manifoldness.
struct TriangleMesh {
    PointCloud vertices;
    std::vector<std::array<std::uint32_t, 3>> triangles;
};

/// Draws `count` points uniformly by area from the triangles (a triangle by its share of
/// the area, then a uniform point inside it). Same mesh, count and seed: same points.
///
/// Errors: kInvalidArgument when count is 0 or a triangle names a vertex that does not
/// exist; kNonFiniteCoordinate when a used vertex is not finite (the message names it);
/// kMalformedFile when the triangles have no area at all.
[[nodiscard]] Result<PointCloud> sampleSurface(const TriangleMesh& mesh, std::size_t count,
                                               std::uint64_t seed);

}  // namespace shapedb
