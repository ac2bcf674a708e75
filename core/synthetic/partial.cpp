#include "core/synthetic/partial.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <numeric>
#include <vector>

#include "core/geometry/box.h"
#include "core/geometry/motion.h"

namespace shapedb {

namespace {

// Points a pixel should hold if the whole box of the silhouette were covered.
constexpr double kPointsPerPixel = 16.0;
constexpr double kBehindPixels = 2.0;
constexpr std::size_t kMostPixels = std::size_t{1} << 22;

}  // namespace

PointCloud seenFrom(const PointCloud& points, const Point3& towards) {
    if (points.empty()) return {};
    const Point3 right = anyPerpendicular(towards);
    const Point3 up = cross(towards, right);
    PointCloud viewed;
    viewed.reserve(points.size());
    for (const Point3& p : points) viewed.push_back({dot(p, right), dot(p, up), dot(p, towards)});
    const Box box = boxOf(viewed);
    const Point3 extent = box.extent();
    const double area = std::max(extent.x, 1e-3 * extent.y) * std::max(extent.y, 1e-3 * extent.x);
    const double pixel = std::max(std::sqrt(kPointsPerPixel * area / static_cast<double>(points.size())),
                                  std::max(extent.x, extent.y) / std::sqrt(static_cast<double>(kMostPixels)));
    if (!(pixel > 0.0)) return points;
    const auto columns = static_cast<std::size_t>(extent.x / pixel) + 1;
    const auto rows = static_cast<std::size_t>(extent.y / pixel) + 1;
    std::vector<double> nearest(columns * rows, -INFINITY);
    const auto pixelOf = [&](const Point3& p) {
        const auto column = static_cast<std::size_t>((p.x - box.low.x) / pixel);
        const auto row = static_cast<std::size_t>((p.y - box.low.y) / pixel);
        return row * columns + column;
    };
    for (const Point3& p : viewed) nearest[pixelOf(p)] = std::max(nearest[pixelOf(p)], p.z);
    PointCloud seen;
    for (std::size_t i = 0; i < points.size(); ++i) {
        if (viewed[i].z >= nearest[pixelOf(viewed[i])] - kBehindPixels * pixel) seen.push_back(points[i]);
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
