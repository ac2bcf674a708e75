// Parameters of the preparation: how a scan is cleaned before it is triangulated.
#pragma once

#include <cstdint>

#include "core/base/error.h"

namespace shapedb {

/// All off by default, as in the paper: every point counts where it is.
struct PreparationOptions {
    /// Scans with more distinct points than this are first averaged onto a grid of about as
    /// many cells. 0: never.
    std::uint32_t decimateTo = 0;

    /// A point is an outlier, and left out, when its distance to its eighth neighbour exceeds this
    /// many times the mean of the same distance at those neighbours. Dimensionless, > 1, or 0:
    /// every point counts.
    double outlierRatio = 0.0;

    /// Noisy points are moved onto a surface fitted to their neighbours out to this many standard
    /// deviations of the estimated noise. In [1, 20], or 0: points stay where they are.
    /// Smaller: noise remains; larger: thin parts shrink.
    double smoothingReach = 0.0;

    /// Then points are thinned until none are closer together than this many times the smallest
    /// distance that sampling and noise can resolve. In (0, 10], or 0: all stay.
    double thinning = 0.0;
};

/// Errors: kInvalidArgument naming the field, its value and its range.
[[nodiscard]] Result<void> validate(const PreparationOptions& options);

}  // namespace shapedb
