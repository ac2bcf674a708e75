// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/preparation/thin.h"

#include <cmath>
#include <new>
#include <string>

#include "core/base/return_if_error.h"

namespace shapedb {

namespace {

constexpr std::uint32_t kUndecided = 0xffffffffu;
constexpr std::size_t kPointsBetweenCheckpoints = 4096;

Result<ThinnedPoints> thinOrThrow(const PointCloud& points, const NeighbourIndex& index, double spacing,
                                  const RunContext& context) {
    std::vector<std::uint32_t> standIn(points.size(), kUndecided);
    std::vector<double> nearest(points.size(), INFINITY);
    std::vector<Neighbour> found;
    std::size_t done = 0;
    for (const Neighbour& next : byDistanceFromCentroid(points)) {
        if (done++ % kPointsBetweenCheckpoints == 0) {
            RETURN_IF_ERROR(context.checkpoint());
        }
        if (standIn[next.point] != kUndecided) continue;
        index.within(points[next.point], spacing, found);
        for (const Neighbour& n : found) {
            // A point left out may lie within reach of several that are kept: the nearest stands for it.
            if (n.squaredDistance >= nearest[n.point]) continue;
            nearest[n.point] = n.squaredDistance;
            standIn[n.point] = next.point;
        }
    }
    ThinnedPoints thinned;
    std::vector<std::uint32_t> rank(points.size(), 0);
    for (std::uint32_t i = 0; i < points.size(); ++i) {
        if (standIn[i] != i) continue;
        rank[i] = static_cast<std::uint32_t>(thinned.points.size());
        thinned.points.push_back(points[i]);
    }
    thinned.siteOfPoint.reserve(points.size());
    for (const std::uint32_t site : standIn) thinned.siteOfPoint.push_back(rank[site]);
    return thinned;
}

}  // namespace

Result<ThinnedPoints> thin(const PointCloud& points, const NeighbourIndex& index, double spacing,
                           const RunContext& context) {
    try {
        return thinOrThrow(points, index, spacing, context);
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::kOutOfMemory,
                    "not enough memory to thin " + std::to_string(points.size()) + " points");
    }
}

}  // namespace shapedb
