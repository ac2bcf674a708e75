// SPDX-License-Identifier: GPL-3.0-or-later
// How far the neighbours of each point are, and which points hang together. For the sources of this folder.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/base/disjoint_sets.h"
#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/geometry/neighbours.h"
#include "core/geometry/point.h"

namespace shapedb {

constexpr std::size_t kReachNeighbours = 8;

/// Each point's nearest neighbours, without itself.
struct Surroundings {
    std::vector<std::uint32_t> near;  ///< kReachNeighbours per point, nearest first
    std::vector<double> reach;        ///< of each point: the distance to the last of them
    double common = 0.0;              ///< the reach that nine in ten points stay within

    [[nodiscard]] std::uint32_t neighbour(std::size_t point, std::size_t rank) const {
        return near[point * kReachNeighbours + rank];
    }
};

/// For more than kReachNeighbours points; `index` holds them. Errors: kCancelled, kDeadlineExceeded.
[[nodiscard]] Result<Surroundings> measureReaches(const PointCloud& points, const NeighbourIndex& index,
                                                  const RunContext& context);

/// Groups of points that are connected by short links between neighbours. Points with `leftOut` set are
/// linked to nothing.
[[nodiscard]] DisjointSets linkedGroups(const PointCloud& points, const Surroundings& around,
                                        const std::vector<std::uint8_t>& leftOut);

}  // namespace shapedb
