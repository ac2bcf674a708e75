// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/synthetic/partial.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <vector>

#include "core/geometry/box.h"
#include "core/geometry/depth_buffer.h"

namespace shapedb {

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
