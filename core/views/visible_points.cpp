// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/views/visible_points.h"

#include <cstddef>

#include "core/geometry/box.h"
#include "core/geometry/depth_buffer.h"

namespace shapedb {

namespace {

constexpr double kBehindPixels = 2.0;

}  // namespace

SeenSurface visiblePoints(const SeenSurface& surface, const PointCloud& hiding, const Point3& towards,
                          double perPixel) {
    if (surface.points.empty()) return {};
    const PointCloud places = alongView(surface.points, towards);
    const Box box = boxOf(places);
    const double pixel = pixelFor(box.extent(), perPixel, hiding.size());
    if (!(pixel > 0.0)) return surface;
    DepthBuffer buffer(box, pixel);
    for (const Point3& p : alongView(hiding, towards)) buffer.add(p);
    SeenSurface seen;
    for (std::size_t i = 0; i < places.size(); ++i) {
        if (buffer.hides(places[i], kBehindPixels * pixel)) continue;
        seen.points.push_back(surface.points[i]);
        seen.normals.push_back(surface.normals[i]);
    }
    return seen;
}

}  // namespace shapedb
