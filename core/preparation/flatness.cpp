#include "core/preparation/flatness.h"

#include <cmath>
#include <cstddef>
#include <utility>

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

}  // namespace shapedb
