#include "core/segmentation/options.h"

#include <cmath>
#include <string>

namespace shapedb {

namespace {

Result<void> require(bool holds, const char* field, double value, const char* range) {
    if (holds) return {};
    return fail(ErrorCode::kInvalidArgument,
                std::string(field) + " is " + std::to_string(value) + "; it must be " + range);
}

}  // namespace

Result<void> validate(const SegmentationOptions& options) {
    const auto angle = [](double degrees) { return degrees > 0.0 && degrees < 90.0; };
    if (auto r = require(options.bigBallRatio > 0.0 && std::isfinite(options.bigBallRatio), "big_ball_ratio",
                         options.bigBallRatio, "above 0");
        !r) {
        return r;
    }
    if (auto r = require(angle(options.deepAngleDegrees), "deep_angle_degrees", options.deepAngleDegrees,
                         "above 0 and below 90 degrees");
        !r) {
        return r;
    }
    if (auto r = require(angle(options.hullAngleDegrees), "hull_angle_degrees", options.hullAngleDegrees,
                         "above 0 and below 90 degrees");
        !r) {
        return r;
    }
    if (auto r = require(options.mergeRatio >= 1.0 && std::isfinite(options.mergeRatio), "merge_ratio",
                         options.mergeRatio, "at least 1");
        !r) {
        return r;
    }
    if (auto r = require(options.mergeContrast == 0.0 ||
                             (options.mergeContrast >= 1.0 && std::isfinite(options.mergeContrast)),
                         "merge_contrast", options.mergeContrast, "0 (off) or at least 1");
        !r) {
        return r;
    }
    if (auto r = require(options.minSegmentShare >= 0.0 && options.minSegmentShare <= 1.0,
                         "min_segment_share", options.minSegmentShare, "between 0 and 1");
        !r) {
        return r;
    }
    if (auto r = require(
            options.strayRatio == 0.0 || (options.strayRatio > 1.0 && std::isfinite(options.strayRatio)),
            "stray_ratio", options.strayRatio, "0 (off) or above 1");
        !r) {
        return r;
    }
    if (auto r = require(options.smoothingReach == 0.0 ||
                             (options.smoothingReach >= 1.0 && options.smoothingReach <= 20.0),
                         "smoothing_reach", options.smoothingReach, "0 (off) or from 1 to 20");
        !r) {
        return r;
    }
    if (auto r = require(options.evenSpacing >= 0.0 && options.evenSpacing <= 10.0, "even_spacing",
                         options.evenSpacing, "0 (off) or at most 10");
        !r) {
        return r;
    }
    return require(options.decimateTo == 0 || options.decimateTo >= 4, "decimate_to",
                   static_cast<double>(options.decimateTo), "0 (never) or at least 4 points");
}

}  // namespace shapedb
