// SPDX-License-Identifier: Apache-2.0
#include "core/geometry/mesh.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "core/base/random.h"
#include "core/base/return_if_error.h"

namespace shapedb {

namespace {

// Running sums of triangle areas; the last entry is the total.
Result<std::vector<double>> cumulativeAreas(const TriangleMesh& mesh) {
    std::vector<double> sums;
    sums.reserve(mesh.triangles.size());
    double total = 0.0;
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
        std::array<Point3, 3> corner;
        for (int i = 0; i < 3; ++i) {
            const std::uint32_t v = mesh.triangles[t][static_cast<std::size_t>(i)];
            if (v >= mesh.vertices.size()) {
                return fail(ErrorCode::kInvalidArgument, "triangle " + std::to_string(t) +
                                                             " refers to vertex " + std::to_string(v) +
                                                             " of " + std::to_string(mesh.vertices.size()));
            }
            corner[static_cast<std::size_t>(i)] = mesh.vertices[v];
            if (!isFinite(corner[static_cast<std::size_t>(i)])) {
                return fail(ErrorCode::kNonFiniteCoordinate,
                            "vertex " + std::to_string(v) + " has a coordinate that is NaN or infinite");
            }
        }
        total += 0.5 * length(cross(corner[1] - corner[0], corner[2] - corner[0]));
        sums.push_back(total);
    }
    return sums;
}

}  // namespace

Result<PointCloud> sampleSurface(const TriangleMesh& mesh, std::size_t count, std::uint64_t seed) {
    if (count == 0)
        return fail(ErrorCode::kInvalidArgument, "the number of points to sample must be at least 1");
    const auto sums = cumulativeAreas(mesh);
    RETURN_IF_ERROR(sums);
    if (sums->empty() || !(sums->back() > 0.0) || !std::isfinite(sums->back())) {
        return fail(ErrorCode::kMalformedFile, "the mesh has no triangle with a finite, positive area");
    }
    Random random(seed);
    PointCloud points;
    points.reserve(count);
    for (std::size_t i = 0; i < count; ++i) {
        const double target = random.uniform() * sums->back();
        const auto at = std::upper_bound(sums->begin(), sums->end(), target);
        const auto t = std::min<std::size_t>(static_cast<std::size_t>(at - sums->begin()), sums->size() - 1);
        const auto& triangle = mesh.triangles[t];
        // Uniform in the triangle: the square root undoes the crowding towards the first corner.
        const double s = std::sqrt(random.uniform());
        const double u = random.uniform();
        points.push_back((1.0 - s) * mesh.vertices[triangle[0]] +
                         (s * (1.0 - u)) * mesh.vertices[triangle[1]] + (s * u) * mesh.vertices[triangle[2]]);
    }
    return points;
}

}  // namespace shapedb
