#include "core/preparation/sanitise.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <new>
#include <numeric>
#include <string>

#include "core/base/large_block.h"
#include "core/base/prefetch.h"
#include "core/base/return_if_error.h"

namespace shapedb {

namespace {

struct Box {
    Point3 low{std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity(),
               std::numeric_limits<double>::infinity()};
    Point3 high{-std::numeric_limits<double>::infinity(), -std::numeric_limits<double>::infinity(),
                -std::numeric_limits<double>::infinity()};
};

Box axisAlignedBox(const PointCloud& points) {
    Box box;
    for (const Point3& p : points) {
        box.low = {std::min(box.low.x, p.x), std::min(box.low.y, p.y), std::min(box.low.z, p.z)};
        box.high = {std::max(box.high.x, p.x), std::max(box.high.y, p.y), std::max(box.high.z, p.z)};
    }
    return box;
}

Result<void> checkCoordinates(const PointCloud& scan) {
    for (std::size_t i = 0; i < scan.size(); ++i) {
        const double coordinates[3] = {scan[i].x, scan[i].y, scan[i].z};
        for (int axis = 0; axis < 3; ++axis) {
            const double value = coordinates[axis];
            const char name = static_cast<char>('x' + axis);
            if (!std::isfinite(value)) {
                return fail(ErrorCode::kNonFiniteCoordinate,
                            "coordinate " + std::string(1, name) + " of point " + std::to_string(i) + " is " +
                                (std::isnan(value) ? "NaN" : "infinite") +
                                "; remove points without a position before uploading");
            }
            if (std::abs(value) > kMaxCoordinate) {
                return fail(ErrorCode::kCoordinateOutOfRange,
                            "coordinate " + std::string(1, name) + " of point " + std::to_string(i) +
                                " exceeds the largest magnitude 3.4e38; choose a larger unit of length");
            }
        }
    }
    return {};
}

// The largest distance from `points` to where `distanceOf` measures from, and who has it.
template <typename Distance>
std::pair<double, std::size_t> farthest(const PointCloud& points, Distance distanceOf) {
    double best = -1.0;
    std::size_t at = 0;
    for (std::size_t i = 0; i < points.size(); ++i) {
        const double d = distanceOf(points[i]);
        if (d > best) {
            best = d;
            at = i;
        }
    }
    return {best, at};
}

// The nearest multiple of kGrid. Adding zero turns -0.0 into 0.0, so that equal points have
// equal bytes.
Point3 onGrid(const Point3& p) {
    const auto round = [](double v) { return kGrid * std::nearbyint(v / kGrid) + 0.0; };
    return {round(p.x), round(p.y), round(p.z)};
}

Result<Frame> frameOfChecked(const PointCloud& scan) {
    const Box box = axisAlignedBox(scan);
    const Point3 half = 0.5 * box.high - 0.5 * box.low;
    const double halfExtent = std::max({half.x, half.y, half.z});
    if (halfExtent == 0.0) {
        return fail(ErrorCode::kAllPointsEqual,
                    "all " + std::to_string(scan.size()) + " points are the same point");
    }
    if (halfExtent < kMinHalfExtent) {
        return fail(ErrorCode::kCoordinateOutOfRange,
                    "the whole scan is smaller than 1.2e-38 units; choose a smaller unit of length");
    }
    int exponent = 0;
    std::frexp(halfExtent, &exponent);
    return Frame{0.5 * box.high + 0.5 * box.low, std::ldexp(1.0, exponent)};
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
    RETURN_IF_ERROR(checkSpansSpace(result.points));
    return result;
}

struct Placed {
    Point3 at;
    std::uint32_t index = 0;
};
using PlacedPoints = LargeVector<Placed>;  // goes back to the system at once

// By coordinates, equal points by index. First into slices along x, as many as points, then each slice
// by itself: linear time unless most points share a few values of x.
PlacedPoints lexicographicallySorted(const PointCloud& points) {
    PlacedPoints sorted(points.size());
    if (points.empty()) return sorted;
    const Box box = axisAlignedBox(points);
    const double extent = box.high.x - box.low.x;
    const auto slices = static_cast<double>(points.size());
    const double perUnit = extent > 0.0 && std::isfinite(slices / extent) ? slices / extent : 0.0;
    const auto sliceOf = [&](const Point3& p) {
        return static_cast<std::size_t>(std::min(slices - 1.0, (p.x - box.low.x) * perUnit));
    };
    std::vector<std::uint32_t> begin(points.size() + 1, 0);
    for (const Point3& p : points) ++begin[sliceOf(p) + 1];
    std::partial_sum(begin.begin(), begin.end(), begin.begin());
    // Every point goes somewhere else: where is asked for before it is written.
    for (std::uint32_t i = 0; i < points.size(); ++i) {
        if (i + kPrefetchFarDistance < points.size())
            prefetch(&begin[sliceOf(points[i + kPrefetchFarDistance])]);
        if (i + kPrefetchDistance < points.size())
            prefetch(sorted.data() + begin[sliceOf(points[i + kPrefetchDistance])]);
        sorted[begin[sliceOf(points[i])]++] = {points[i], i};
    }
    std::size_t from = 0;
    for (std::size_t slice = 0; slice < points.size(); ++slice) {
        const std::size_t to = begin[slice];  // moved to the end of the slice while filling it
        if (to - from > 1) {
            std::sort(sorted.begin() + static_cast<std::ptrdiff_t>(from),
                      sorted.begin() + static_cast<std::ptrdiff_t>(to), [](const Placed& a, const Placed& b) {
                          if (a.at != b.at) return lexicographicLess(a.at, b.at);
                          return a.index < b.index;
                      });
        }
        from = to;
    }
    return sorted;
}

}  // namespace

MergedPoints mergeDuplicates(const PointCloud& points) {
    const PlacedPoints sorted = lexicographicallySorted(points);
    MergedPoints merged;
    merged.points.reserve(points.size());
    merged.siteOfPoint.resize(points.size());
    for (const Placed& p : sorted) {
        if (merged.points.empty() || merged.points.back() != p.at) merged.points.push_back(p.at);
        merged.siteOfPoint[p.index] = static_cast<std::uint32_t>(merged.points.size() - 1);
    }
    return merged;
}

// Grows a simplex greedily: far point, far from the line, far from the plane. Within a factor
// of two of the widest, which is all a tolerance needs.
Result<void> checkSpansSpace(const PointCloud& points) {
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

Result<Frame> frameOf(const PointCloud& scan) {
    if (scan.size() < 4) {
        return fail(ErrorCode::kTooFewPoints,
                    "the scan has " + std::to_string(scan.size()) + " points; at least 4 are needed");
    }
    if (scan.size() >= std::numeric_limits<std::uint32_t>::max()) {
        return fail(ErrorCode::kPointLimitExceeded, "the scan has more than 4,294,967,294 points");
    }
    RETURN_IF_ERROR(checkCoordinates(scan));
    return frameOfChecked(scan);
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
