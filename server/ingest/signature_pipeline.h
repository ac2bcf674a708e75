// The road from points to signature as the server calls it: `shapedb::describe`, or in tests
// something quicker.
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "core/geometry/point.h"
#include "core/pipeline.h"

namespace shapedb::ingest {

/// Must be thread-safe and, as everything in core/, throw nothing.
using SignaturePipeline =
    std::function<Result<Description>(const PointCloud&, const ShapeParameters&, const RunContext&)>;

/// Packed x y z, as stored and as sent, to points. Throws std::bad_alloc.
inline PointCloud toCloud(const std::vector<float>& xyz) {
    PointCloud points;
    points.reserve(xyz.size() / 3);
    for (std::size_t i = 0; i + 2 < xyz.size(); i += 3) points.push_back({xyz[i], xyz[i + 1], xyz[i + 2]});
    return points;
}

}  // namespace shapedb::ingest
