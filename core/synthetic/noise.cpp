#include "core/synthetic/noise.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "core/base/random.h"

namespace shapedb {

namespace {

bool isFinite(const Point3& p) { return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z); }

// Not sqrt(x*x + ...): that overflows from 1e154 on and vanishes below 1e-162.
double boxDiagonal(const PointCloud& points) {
    Point3 low = points.front();
    Point3 high = points.front();
    for (const Point3& p : points) {
        low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
        high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
    }
    return std::hypot(high.x - low.x, high.y - low.y, high.z - low.z);
}

}  // namespace

Result<void> addGaussianNoise(PointCloud& points, double shareOfDiagonal, std::uint64_t seed) {
    if (!std::isfinite(shareOfDiagonal) || shareOfDiagonal < 0.0) {
        return fail(
            ErrorCode::kInvalidArgument,
            "noise must be a share of the box diagonal of 0 or more, got " + std::to_string(shareOfDiagonal));
    }
    for (std::size_t i = 0; i < points.size(); ++i) {
        if (!isFinite(points[i])) {
            return fail(ErrorCode::kNonFiniteCoordinate,
                        "point " + std::to_string(i) + " has a coordinate that is NaN or infinite");
        }
    }
    if (points.empty() || shareOfDiagonal == 0.0) return {};

    const double sigma = shareOfDiagonal * boxDiagonal(points);
    Random random(seed);
    PointCloud noisy;
    noisy.reserve(points.size());
    for (std::size_t i = 0; i < points.size(); ++i) {
        Point3 p = points[i];
        p.x += sigma * random.normal();
        p.y += sigma * random.normal();
        p.z += sigma * random.normal();
        if (!isFinite(p)) {
            return fail(
                ErrorCode::kCoordinateOutOfRange,
                "noise takes point " + std::to_string(i) + " beyond double precision; scale the scan down");
        }
        noisy.push_back(p);
    }
    points = std::move(noisy);
    return {};
}

PointCloud subsample(const PointCloud& points, std::size_t count, std::uint64_t seed) {
    if (count >= points.size()) return points;
    PointCloud chosen;
    chosen.reserve(count);
    Random random(seed);
    // Selection sampling (Knuth, algorithm S): each point is taken with probability
    // still wanted / still to come, which makes all subsets equally likely in one ordered pass.
    for (std::size_t i = 0; i < points.size() && chosen.size() < count; ++i) {
        if (random.below(points.size() - i) < count - chosen.size()) chosen.push_back(points[i]);
    }
    return chosen;
}

}  // namespace shapedb
