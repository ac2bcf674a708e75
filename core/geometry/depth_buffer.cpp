// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/geometry/depth_buffer.h"

#include <algorithm>
#include <cmath>

#include "core/geometry/motion.h"

namespace shapedb {

namespace {

// An outline is taken to be at least this share of its length wide.
constexpr double kLeastWidth = 1e-3;

}  // namespace

PointCloud alongView(const PointCloud& points, const Point3& towards) {
    const Point3 right = anyPerpendicular(towards);
    const Point3 up = cross(towards, right);
    PointCloud viewed;
    viewed.reserve(points.size());
    for (const Point3& p : points) viewed.push_back({dot(p, right), dot(p, up), dot(p, towards)});
    return viewed;
}

DepthBuffer::DepthBuffer(const Box& box, double pixel)
    : box_(box), pixel_(pixel), columns_(static_cast<std::size_t>(box.extent().x / pixel) + 1) {
    const auto rows = static_cast<std::size_t>(box.extent().y / pixel) + 1;
    nearest_.assign(columns_ * rows, -INFINITY);
}

std::size_t DepthBuffer::pixelOf(const Point3& point) const {
    const auto column = static_cast<std::size_t>((point.x - box_.low.x) / pixel_);
    const auto row = static_cast<std::size_t>((point.y - box_.low.y) / pixel_);
    return row * columns_ + column;
}

void DepthBuffer::add(const Point3& point) {
    const bool outside =
        point.x < box_.low.x || point.y < box_.low.y || point.x > box_.high.x || point.y > box_.high.y;
    if (outside) return;
    double& depth = nearest_[pixelOf(point)];
    depth = std::max(depth, point.z);
}

bool DepthBuffer::hides(const Point3& point, double behind) const {
    return point.z < nearest_[pixelOf(point)] - behind;
}

double pixelFor(const Point3& extent, double perPixel, std::size_t count) {
    const double area =
        std::max(extent.x, kLeastWidth * extent.y) * std::max(extent.y, kLeastWidth * extent.x);
    return std::sqrt(perPixel * area / static_cast<double>(std::max<std::size_t>(1, count)));
}

}  // namespace shapedb
