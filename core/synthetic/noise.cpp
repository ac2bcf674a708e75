// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/synthetic/noise.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "core/base/number_text.h"
#include "core/base/random.h"
#include "core/base/random_subset.h"
#include "core/geometry/box.h"

namespace shapedb {

namespace {

// Not Box::diagonal(): its squares overflow from 1e154 on and vanish below 1e-162.
double boxDiagonal(const PointCloud& points) {
    const Point3 extent = boxOf(points).extent();
    return std::hypot(extent.x, extent.y, extent.z);
}

}  // namespace

Result<void> addGaussianNoise(PointCloud& points, double shareOfDiagonal, std::uint64_t seed) {
    if (!std::isfinite(shareOfDiagonal) || shareOfDiagonal < 0.0) {
        return fail(ErrorCode::kInvalidArgument,
                    "the noise must be 0 or a positive share of the box diagonal, but is " +
                        numberText(shareOfDiagonal));
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
    for (const std::size_t i : randomSubset(points.size(), count, random)) chosen.push_back(points[i]);
    return chosen;
}

void addTable(PointCloud& cloud, std::size_t count, double reach, double noise, std::uint64_t seed) {
    const Box box = boxOf(cloud);
    const Point3 middle = 0.5 * (box.low + box.high);
    const double half = 0.5 * reach * std::max(box.extent().x, box.extent().y);
    Random random(seed);
    for (std::size_t i = 0; i < count; ++i) {
        cloud.push_back({middle.x + random.uniform(-half, half), middle.y + random.uniform(-half, half),
                         box.low.z - 0.002 * half + noise * random.normal()});
    }
}

}  // namespace shapedb
