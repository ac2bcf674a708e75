#include "core/views/visible_points.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "core/geometry/box.h"
#include "core/geometry/motion.h"

namespace shapedb {

namespace {

constexpr double kBehindPixels = 2.0;
// An outline is taken to be at least this share of its length wide.
constexpr double kLeastWidth = 1e-3;

}  // namespace

SeenSurface visiblePoints(const SeenSurface& surface, const PointCloud& hiding, const Point3& towards,
                          double perPixel) {
    if (surface.points.empty()) return {};
    const Point3 right = anyPerpendicular(towards);
    const Point3 up = cross(towards, right);
    const auto along = [&](const PointCloud& points) {
        PointCloud viewed;
        viewed.reserve(points.size());
        for (const Point3& p : points) viewed.push_back({dot(p, right), dot(p, up), dot(p, towards)});
        return viewed;
    };
    const PointCloud places = along(surface.points);
    const Box box = boxOf(places);
    const Point3 extent = box.extent();
    const double area =
        std::max(extent.x, kLeastWidth * extent.y) * std::max(extent.y, kLeastWidth * extent.x);
    const auto count = static_cast<double>(std::max<std::size_t>(1, hiding.size()));
    const double pixel = std::sqrt(perPixel * area / count);
    if (!(pixel > 0.0)) return surface;
    const auto columns = static_cast<std::size_t>(extent.x / pixel) + 1;
    const auto rows = static_cast<std::size_t>(extent.y / pixel) + 1;
    std::vector<double> nearest(columns * rows, -INFINITY);
    const auto pixelOf = [&](const Point3& p) {
        const auto column = static_cast<std::size_t>((p.x - box.low.x) / pixel);
        const auto row = static_cast<std::size_t>((p.y - box.low.y) / pixel);
        return row * columns + column;
    };
    for (const Point3& p : along(hiding)) {
        const bool outside = p.x < box.low.x || p.y < box.low.y || p.x > box.high.x || p.y > box.high.y;
        if (outside) continue;
        double& depth = nearest[pixelOf(p)];
        depth = std::max(depth, p.z);
    }
    SeenSurface seen;
    for (std::size_t i = 0; i < places.size(); ++i) {
        if (places[i].z < nearest[pixelOf(places[i])] - kBehindPixels * pixel) continue;
        seen.points.push_back(surface.points[i]);
        seen.normals.push_back(surface.normals[i]);
    }
    return seen;
}

}  // namespace shapedb
