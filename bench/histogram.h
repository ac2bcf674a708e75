// SPDX-License-Identifier: GPL-3.0-or-later
// Histograms as descriptors and the usual distances between them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/base/error.h"
#include "core/geometry/point.h"

namespace shapedb::bench {

/// Values of at least 0, all finite.
using Histogram = std::vector<float>;

// Both take histograms of the same size and give 0 for equal ones; symmetric bit for bit.
/// Sum of |a - b|.
[[nodiscard]] double l1Distance(const Histogram& a, const Histogram& b);
/// Sum of (a - b)^2 / (a + b) over the bins that are not both 0.
[[nodiscard]] double chiSquareDistance(const Histogram& a, const Histogram& b);

// D2, the shape distribution of Osada, Funkhouser, Chazelle and Dobkin (2002): how far apart two
// random points of the shape lie. The simplest useful descriptor, and the unit in which
// the cost of the others is given.

struct D2Options {
    std::size_t pairs = 100000;  ///< random pairs of points, at least 1
    std::size_t bins = 128;      ///< at least 1
    /// Largest distance with a bin of its own, in mean distances, so that size does not matter. Longer
    /// ones go into the last bin.
    double range = 3.0;
};

/// Shares of the pairs by distance, summing to 1. Both points of a pair may be the same one. Deterministic;
/// up to rounding, position and size of the cloud do not matter.
///
/// Errors: kTooFewPoints (none), kAllPointsEqual (no two points of the pairs differ),
/// kInvalidArgument (options).
[[nodiscard]] Result<Histogram> d2Histogram(const PointCloud& points, std::uint64_t seed,
                                            const D2Options& options = {});

}  // namespace shapedb::bench
