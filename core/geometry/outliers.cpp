#include "core/geometry/outliers.h"

#include <cmath>
#include <new>
#include <string>

namespace shapedb {

namespace {

constexpr std::size_t kNeighbours = 8;
constexpr std::size_t kPointsBetweenCheckpoints = 4096;

Result<std::vector<std::uint8_t>> findStraysOrThrow(const PointCloud& points, const NeighbourIndex& index,
                                                    double ratio, const RunContext& context) {
    std::vector<std::uint8_t> stray(points.size(), 0);
    if (points.size() <= kNeighbours) return stray;
    std::vector<std::uint32_t> near(points.size() * kNeighbours);
    std::vector<double> reach(points.size());
    std::vector<Neighbour> found;
    std::size_t done = 0;
    for (const std::uint32_t i : index.order()) {
        if (done++ % kPointsBetweenCheckpoints == 0) {
            if (auto go = context.checkpoint(); !go) return fail(go.error());
        }
        index.nearest(points[i], kNeighbours + 1, found);  // the first is the point itself
        for (std::size_t k = 0; k < kNeighbours; ++k) near[i * kNeighbours + k] = found[k + 1].point;
        reach[i] = std::sqrt(found.back().squaredDistance);
    }
    for (std::size_t i = 0; i < points.size(); ++i) {
        double sum = 0.0;
        for (std::size_t k = 0; k < kNeighbours; ++k) sum += reach[near[i * kNeighbours + k]];
        stray[i] = reach[i] * static_cast<double>(kNeighbours) > ratio * sum ? 1 : 0;
    }
    return stray;
}

}  // namespace

Result<std::vector<std::uint8_t>> findStrays(const PointCloud& points, const NeighbourIndex& index,
                                             double ratio, const RunContext& context) {
    try {
        return findStraysOrThrow(points, index, ratio, context);
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::kOutOfMemory, "not enough memory to look for strays among " +
                                                 std::to_string(points.size()) + " points");
    }
}

}  // namespace shapedb
