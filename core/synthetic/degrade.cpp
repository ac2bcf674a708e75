// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/synthetic/degrade.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <string>
#include <utility>
#include <vector>

#include "core/base/number_text.h"
#include "core/base/random.h"
#include "core/geometry/box.h"
#include "core/geometry/depth_buffer.h"

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

namespace {

// Points a pixel should hold if the whole box of the silhouette were covered.
constexpr double kPointsPerPixel = 16.0;
constexpr double kBehindPixels = 2.0;
constexpr std::size_t kMostPixels = std::size_t{1} << 22;

}  // namespace

PointCloud seenFrom(const PointCloud& points, const Point3& towards) {
    if (points.empty()) return {};
    const PointCloud viewed = alongView(points, towards);
    const Box box = boxOf(viewed);
    const Point3 extent = box.extent();
    const double pixel = std::max(pixelFor(extent, kPointsPerPixel, points.size()),
                                  std::max(extent.x, extent.y) / std::sqrt(static_cast<double>(kMostPixels)));
    if (!(pixel > 0.0)) return points;
    DepthBuffer buffer(box, pixel);
    for (const Point3& p : viewed) buffer.add(p);
    PointCloud seen;
    for (std::size_t i = 0; i < points.size(); ++i) {
        if (!buffer.hides(viewed[i], kBehindPixels * pixel)) seen.push_back(points[i]);
    }
    return seen;
}

PointCloud cutBelow(const PointCloud& points, const Point3& direction, double share) {
    std::vector<std::size_t> order(points.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
        return dot(points[a], direction) < dot(points[b], direction);
    });
    order.resize(static_cast<std::size_t>(std::clamp(share, 0.0, 1.0) * static_cast<double>(points.size())));
    std::sort(order.begin(), order.end());
    PointCloud left;
    for (const std::size_t i : order) left.push_back(points[i]);
    return left;
}

PointCloud withHole(const PointCloud& points, const Point3& centre, double radius) {
    PointCloud left;
    for (const Point3& p : points) {
        if (squaredDistance(p, centre) > radius * radius) left.push_back(p);
    }
    return left;
}

}  // namespace shapedb
