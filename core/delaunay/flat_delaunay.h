// SPDX-License-Identifier: GPL-3.0-or-later
// Builds the triangulation in the cell store, with one thread or several. delaunay.h is what users call.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/delaunay/bowyer_watson.h"

namespace shapedb {

/// How many points make parallel insertion worth its overhead. Results do not depend on it.
struct ParallelLimits {
    std::size_t minPoints = 50000;    ///< of the whole triangulation
    std::size_t minPerThread = 4096;  ///< of one round; at least 1
};

/// Triangulates `sites` into the empty `cells`, with up to `threads` threads of the caller's arena. Any order
/// of the sites gives the same triangulation; Hilbert order is fast. The set of cells is the same for any
/// number of threads, where they lie in the store is not.
///
/// Errors: kTooFewPoints, kCollinear, kCoplanar (decided exactly); kInternal when two sites coincide;
/// kCancelled, kDeadlineExceeded; kOutOfMemory. May throw std::bad_alloc.
[[nodiscard]] Result<void> buildTriangulation(LargeVector<Site>& sites, CellStore& cells, std::size_t threads,
                                              const RunContext& context, const ParallelLimits& limits = {});

}  // namespace shapedb
