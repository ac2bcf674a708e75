// Distances inside the shape: along the shortest way that does not leave the interior.
#pragma once

#include <cstdint>
#include <vector>

#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/signature/interior_view.h"

namespace shapedb {

/// The interior as a coarse graph: about kCells cells, each a connected lump of tetrahedra within
/// one cube of a grid (so two limbs that pass close by stay apart), joined where they touch.
/// Lengths in the view's unit.
struct InnerDistances {
    static constexpr std::size_t kCells = 1500;
    static constexpr std::size_t kSources = 192;
    static constexpr double kUnreached = 1e300;  ///< between two pieces of an interior in pieces

    std::vector<std::uint32_t> cellOfTetrahedron;
    PointCloud centres;           ///< of the cells
    std::vector<double> volumes;  ///< of the cells

    std::vector<std::uint32_t> sources;         ///< cells, evenly spread over the volume
    std::vector<std::vector<double>> distance;  ///< per source to every cell, or kUnreached
    double mean = 0.0;                          ///< over sources and volume, of those reached; > 0
};

/// Deterministic. Errors: kCancelled, kDeadlineExceeded.
[[nodiscard]] Result<InnerDistances> innerDistances(const InteriorView& view, const RunContext& context = {});

}  // namespace shapedb
