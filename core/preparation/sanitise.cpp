#include "core/preparation/sanitise.h"

#include <cmath>
#include <new>
#include <string>
#include <utility>

#include "core/base/return_if_error.h"
#include "core/geometry/merge_duplicates.h"
#include "core/preparation/flatness.h"

namespace shapedb {

namespace {

// The nearest multiple of kGrid. Adding zero turns -0.0 into 0.0, so that equal points have equal bytes.
Point3 onGrid(const Point3& p) {
    const auto round = [](double v) { return kGrid * std::nearbyint(v / kGrid) + 0.0; };
    return {round(p.x), round(p.y), round(p.z)};
}

Result<SanitisedPoints> sanitiseOrThrow(const PointCloud& scan) {
    const auto frame = frameOf(scan);
    RETURN_IF_ERROR(frame);
    SanitisedPoints result;
    result.frame = *frame;
    const double inverse = 1.0 / result.frame.unit;  // exact: a power of two
    PointCloud scaled(scan.size());
    for (std::size_t i = 0; i < scan.size(); ++i) {
        scaled[i] = onGrid(inverse * (scan[i] - result.frame.centre));
    }
    MergedPoints merged = mergeDuplicates(scaled);
    result.duplicates = scan.size() - merged.points.size();
    result.points = std::move(merged.points);
    result.siteOfPoint = std::move(merged.siteOfPoint);
    if (result.points.size() < 4) {
        return fail(ErrorCode::kTooFewPoints, "only " + std::to_string(result.points.size()) + " of " +
                                                  std::to_string(scan.size()) +
                                                  " points are distinct; at least 4 are needed");
    }
    RETURN_IF_ERROR(checkNotFlat(result.points));
    return result;
}

}  // namespace

Result<SanitisedPoints> sanitise(const PointCloud& scan) {
    try {
        return sanitiseOrThrow(scan);
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::kOutOfMemory,
                    "not enough memory to sort " + std::to_string(scan.size()) + " points");
    }
}

}  // namespace shapedb
