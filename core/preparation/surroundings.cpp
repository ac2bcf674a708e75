// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/preparation/surroundings.h"

#include <algorithm>
#include <cmath>

#include "core/base/parallel.h"
#include "core/base/return_if_error.h"

namespace shapedb {

namespace {

constexpr double kCommonShare = 0.9;
constexpr double kLinkInReaches = 3.0;     // of the common reach
constexpr double kOwnLinkInReaches = 1.5;  // of the mean reach of the two ends

}  // namespace

Result<Surroundings> measureReaches(const PointCloud& points, const NeighbourIndex& index,
                                    const RunContext& context) {
    Surroundings around;
    around.near.resize(points.size() * kReachNeighbours);
    around.reach.resize(points.size());
    const auto measureOne = [&, found = std::vector<Neighbour>()](std::uint32_t i) mutable {
        index.nearest(points[i], kReachNeighbours + 1, found);  // the first is the point itself
        for (std::size_t k = 0; k < kReachNeighbours; ++k)
            around.near[i * kReachNeighbours + k] = found[k + 1].point;
        around.reach[i] = std::sqrt(found.back().squaredDistance);
    };
    RETURN_IF_ERROR(parallelForPoints(index.order(), context, measureOne));
    std::vector<double> sorted = around.reach;
    const auto common =
        sorted.begin() + static_cast<std::ptrdiff_t>(kCommonShare * static_cast<double>(sorted.size() - 1));
    std::nth_element(sorted.begin(), common, sorted.end());
    around.common = *common;
    return around;
}

DisjointSets linkedGroups(const PointCloud& points, const Surroundings& around,
                          const std::vector<std::uint8_t>& leftOut) {
    DisjointSets groups(points.size());
    for (std::uint32_t i = 0; i < points.size(); ++i) {
        for (std::size_t k = 0; !leftOut[i] && k < kReachNeighbours; ++k) {
            const std::uint32_t j = around.neighbour(i, k);
            if (leftOut[j]) continue;
            const double link = std::max(kLinkInReaches * around.common,
                                         kOwnLinkInReaches * 0.5 * (around.reach[i] + around.reach[j]));
            if (squaredDistance(points[i], points[j]) <= link * link) groups.unite(i, j);
        }
    }
    return groups;
}

}  // namespace shapedb
