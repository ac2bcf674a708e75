// SPDX-License-Identifier: GPL-3.0-or-later
// Inner distances: lengths of shortest paths that stay in the interior.
#pragma once

#include <cstdint>
#include <limits>
#include <vector>

#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/signature/interior_view.h"

namespace shapedb {

/// The interior as about kCells cells, joined where they touch. A cell is a connected lump of voxels within
/// one cube of a grid, so limbs that pass close by each other stay separate. Lengths are in the view's unit.
struct InnerDistances {
    static constexpr std::size_t kCells = 800;
    static constexpr std::size_t kSources = 80;
    static constexpr double kUnreached = 1e300;  ///< distance between separate pieces of the interior
    static constexpr std::uint32_t kNoCell = std::numeric_limits<std::uint32_t>::max();

    PointCloud centres;           ///< of the cells, inside them: what distances are measured between
    std::vector<double> volumes;  ///< of the cells

    /// Points spread evenly over the volume: all stand for the same share of it.
    struct Matter {
        std::uint32_t tetrahedron;
        std::uint32_t cell;  ///< kNoCell for matter too thin to be near one
    };
    std::vector<Matter> matter;

    std::vector<std::uint32_t> sources;         ///< cells, evenly spread over the volume
    std::vector<std::vector<double>> distance;  ///< from each source to every cell, or kUnreached
    double mean = 0.0;                          ///< over sources and volume, where reached; > 0
};

/// Deterministic. Errors: kCancelled, kDeadlineExceeded.
[[nodiscard]] Result<InnerDistances> innerDistances(const InteriorView& view, const RunContext& context = {});

}  // namespace shapedb
