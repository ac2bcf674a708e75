// Inner distances: lengths of shortest paths that stay in the interior.
#pragma once

#include <cstdint>
#include <vector>

#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/signature/interior_view.h"

namespace shapedb {

/// The interior as a graph of about kCells cells, joined where they touch. A cell is a connected lump of
/// tetrahedra within one cube of a grid, so limbs that pass close by each other stay separate. Lengths are in
/// the view's unit.
struct InnerDistances {
    static constexpr std::size_t kCells = 1500;
    static constexpr std::size_t kSources = 192;
    static constexpr double kUnreached = 1e300;  ///< distance between separate pieces of the interior

    std::vector<std::uint32_t> cellOfTetrahedron;
    PointCloud centres;           ///< of the cells
    std::vector<double> volumes;  ///< of the cells

    std::vector<std::uint32_t> sources;         ///< cells, evenly spread over the volume
    std::vector<std::vector<double>> distance;  ///< from each source to every cell, or kUnreached
    double mean = 0.0;                          ///< over sources and volume, where reached; > 0
};

/// Deterministic. Errors: kCancelled, kDeadlineExceeded.
[[nodiscard]] Result<InnerDistances> innerDistances(const InteriorView& view, const RunContext& context = {});

}  // namespace shapedb
