// The Delaunay triangulation of points in an order of their own, by one thread or several.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/delaunay/bowyer_watson.h"

namespace shapedb {

/// What is worth dividing between threads, in points. Results do not depend on it.
struct Division {
    std::size_t leastPoints = 50000;  ///< of the whole triangulation
    std::size_t leastShare = 4096;    ///< of a round, for each thread; at least 1
};

/// Triangulates `sites`, which should follow a curve through space (curve_order.h), with up to
/// `threads` threads of the caller's arena. The set of cells is the same for any number; their places
/// in the store are not.
///
/// Errors: kCoplanar, kCollinear, kTooFewPoints (exactly so); kInternal when two sites are at the same
/// place; kCancelled, kDeadlineExceeded; kOutOfMemory. May throw std::bad_alloc.
[[nodiscard]] Result<void> insertAll(LargeVector<Site>& sites, CellStore& cells, std::size_t threads,
                                     const RunContext& context, const Division& division = {});

}  // namespace shapedb
