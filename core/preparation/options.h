// SPDX-License-Identifier: GPL-3.0-or-later
// Options for preparing a scan before it is triangulated.
#pragma once

#include <cstdint>

#include "core/base/error.h"

namespace shapedb {

/// Off by default, as in the paper: every point counts where it is.
struct PreparationOptions {
    /// Scans with more distinct points than this are averaged onto a grid of about as many
    /// cells. At least 4, or 0: never.
    std::uint32_t decimateTo = 0;

    /// Outliers are left out: points whose distance to their eighth neighbour exceeds this many
    /// times the mean of the same distance at those neighbours. > 1, or 0: none are.
    double outlierRatio = 0.0;

    /// Noisy points are moved onto a surface fitted to their neighbours within this many standard
    /// deviations of the estimated noise. In [1, 20], or 0: points stay where they are. Too small
    /// leaves noise, too large shrinks thin parts.
    double smoothingReach = 0.0;

    /// Points are thinned until no two are closer than this many times the smallest distance
    /// that sampling and noise can resolve. In (0, 10], or 0: all stay.
    double thinning = 0.0;
};

/// Errors: kInvalidArgument naming the field, its value and its range.
[[nodiscard]] Result<void> validate(const PreparationOptions& options);

}  // namespace shapedb
