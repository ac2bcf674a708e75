// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/preparation/options.h"

#include <cmath>

#include "core/base/range_check.h"
#include "core/base/return_if_error.h"

namespace shapedb {

Result<void> validate(const PreparationOptions& options) {
    RETURN_IF_ERROR(requireInRange(
        options.outlierRatio == 0.0 || (options.outlierRatio > 1.0 && std::isfinite(options.outlierRatio)),
        "outlier_ratio", options.outlierRatio, "0 (off) or above 1"));
    RETURN_IF_ERROR(requireInRange(
        options.smoothingReach == 0.0 || (options.smoothingReach >= 1.0 && options.smoothingReach <= 20.0),
        "smoothing_reach", options.smoothingReach, "0 (off) or from 1 to 20"));
    RETURN_IF_ERROR(requireInRange(options.thinning >= 0.0 && options.thinning <= 10.0, "thinning",
                                   options.thinning, "0 (off) or at most 10"));
    return requireInRange(options.decimateTo == 0 || options.decimateTo >= 4, "decimate_to",
                          static_cast<double>(options.decimateTo), "0 (never) or at least 4 points");
}

}  // namespace shapedb
