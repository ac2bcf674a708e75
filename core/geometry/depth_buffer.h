// SPDX-License-Identifier: GPL-3.0-or-later
// What a far camera sees of points: for each pixel how near the nearest one is.
#pragma once

#include <cstddef>
#include <vector>

#include "core/geometry/box.h"
#include "core/geometry/point.h"

namespace shapedb {

/// The points as a camera has them that looks along -`towards`, a unit vector from the shape to the camera: x
/// and y across the view, z towards the camera.
[[nodiscard]] PointCloud alongView(const PointCloud& points, const Point3& towards);

/// Over the x and y of points as alongView gives them.
class DepthBuffer {
  public:
    /// `box`: of all that will be asked for. Pixels are `pixel` wide and high, above 0.
    DepthBuffer(const Box& box, double pixel);

    /// `point` hides what lies behind it. Outside the box it hides nothing.
    void add(const Point3& point);
    /// Whether `point`, inside the box, lies more than `behind` behind the nearest point of its pixel.
    [[nodiscard]] bool hides(const Point3& point, double behind) const;

  private:
    [[nodiscard]] std::size_t pixelOf(const Point3& point) const;

    Box box_;
    double pixel_;
    std::size_t columns_;
    std::vector<double> nearest_;
};

/// The width of a pixel that holds `perPixel` of `count` points, at least 1, on average, if the whole
/// `extent` of the view were covered; a view is taken to be at least 1/1000 of its length wide. 0 for a
/// single place.
[[nodiscard]] double pixelFor(const Point3& extent, double perPixel, std::size_t count);

}  // namespace shapedb
