// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/segmentation/options.h"

#include <cmath>

#include "core/base/range_check.h"
#include "core/base/return_if_error.h"

namespace shapedb {

Result<void> validate(const SegmentationOptions& options) {
    const auto angle = [](double degrees) { return degrees > 0.0 && degrees < 90.0; };
    RETURN_IF_ERROR(requireInRange(options.bigBallRatio > 0.0 && std::isfinite(options.bigBallRatio),
                                   "big_ball_ratio", options.bigBallRatio, "above 0"));
    RETURN_IF_ERROR(requireInRange(angle(options.deepAngleDegrees), "deep_angle_degrees",
                                   options.deepAngleDegrees, "above 0 and below 90 degrees"));
    RETURN_IF_ERROR(requireInRange(angle(options.hullAngleDegrees), "hull_angle_degrees",
                                   options.hullAngleDegrees, "above 0 and below 90 degrees"));
    RETURN_IF_ERROR(requireInRange(options.mergeRatio >= 1.0 && std::isfinite(options.mergeRatio),
                                   "merge_ratio", options.mergeRatio, "at least 1"));
    RETURN_IF_ERROR(requireInRange(options.mergeContrast == 0.0 ||
                                       (options.mergeContrast >= 1.0 && std::isfinite(options.mergeContrast)),
                                   "merge_contrast", options.mergeContrast, "0 (off) or at least 1"));
    RETURN_IF_ERROR(requireInRange(options.minSegmentShare >= 0.0 && options.minSegmentShare <= 1.0,
                                   "min_segment_share", options.minSegmentShare, "between 0 and 1"));
    return validate(options.preparation);
}

}  // namespace shapedb
