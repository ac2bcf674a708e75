// D2, the shape distribution of Osada, Funkhouser, Chazelle and Dobkin (2002): how far apart two
// random points of the shape lie. The plainest descriptor that is of any use, and the unit in which
// the costs of the others are told.
#pragma once

#include <cstddef>
#include <cstdint>

#include "bench/histogram.h"
#include "core/base/error.h"
#include "core/geometry/point.h"

namespace shapedb::bench {

struct D2Options {
    std::size_t pairs = 100000;  ///< random pairs of points, at least 1
    std::size_t bins = 128;      ///< at least 1
    /// Largest distance that has a bin of its own, in mean distances: shapes of any size compare.
    /// Longer ones count in the last bin.
    double range = 3.0;
};

/// Shares of the pairs by distance; they add up to 1. Points of a pair may be the same point.
/// Same points, options and seed: same histogram; position and size of the cloud do not matter, up to
/// rounding.
///
/// Errors: kTooFewPoints (none), kAllPointsEqual (no two points of the pairs differ),
/// kInvalidArgument (options).
[[nodiscard]] Result<Histogram> d2Histogram(const PointCloud& points, std::uint64_t seed,
                                            const D2Options& options = {});

}  // namespace shapedb::bench
