// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/preparation/sanitise.h"

#include <cmath>
#include <cstddef>
#include <new>
#include <string>
#include <utility>

#include "core/base/return_if_error.h"
#include "core/geometry/merge_duplicates.h"

namespace shapedb {

namespace {

// The point with the largest value of `measure`, and that value.
template <typename Measure>
std::pair<double, std::size_t> farthest(const PointCloud& points, Measure measure) {
    double best = -1.0;
    std::size_t at = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
        const double d = measure(points[i]);
        if (d > best) {
            best = d;
            at = i;
        }
    }
    return {best, at};
}

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

// Grows a simplex greedily: the farthest point, the farthest from that line, the farthest from that
// plane. Within a factor of two of the widest simplex, which is close enough for a tolerance.
Result<void> checkNotFlat(const PointCloud& points) {
    const Point3& origin = points.front();
    const auto [reach, b] = farthest(points, [&](const Point3& p) { return distance(p, origin); });
    const Point3 axis = (1.0 / reach) * (points[b] - origin);
    const auto [width, c] =
        farthest(points, [&](const Point3& p) { return length(cross(axis, p - origin)); });
    if (width <= kFlatnessTolerance) {
        return fail(ErrorCode::kCollinear,
                    "all points lie on one line; a shape needs points all around its surface");
    }
    const Point3 across = cross(axis, points[c] - origin);
    const Point3 normal = (1.0 / length(across)) * across;
    const auto height = farthest(points, [&](const Point3& p) { return std::abs(dot(normal, p - origin)); });
    if (height.first <= kFlatnessTolerance) {
        return fail(ErrorCode::kCoplanar,
                    "all points lie in one plane; a shape needs points all around its surface");
    }
    return {};
}

Result<SanitisedPoints> sanitise(const PointCloud& scan) {
    try {
        return sanitiseOrThrow(scan);
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::kOutOfMemory,
                    "not enough memory to sort " + std::to_string(scan.size()) + " points");
    }
}

}  // namespace shapedb
