// SPDX-License-Identifier: Apache-2.0
// Where the points of a scan lie, whatever a few outliers do: a point at 0, 0, 0 that stands for "nothing
// seen", or one that a scanner placed kilometres away, says nothing about the size of the rest.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "core/geometry/box.h"
#include "core/geometry/point.h"

namespace shapedb {

/// Outliers are beyond this many diagonals of the box that holds the middle half of each coordinate, from its
/// middle. The surface of a ball ends before two of them.
constexpr double kMainReach = 4.0;

struct MainPart {
    Box box;                   ///< of the points that are no outliers
    std::uint64_t points = 0;  ///< that many; more than half of all
    std::uint64_t outliers = 0;

    /// All points but the outliers are one.
    [[nodiscard]] bool isPoint() const { return box.low == box.high; }
};

namespace main_part {

/// More are not sorted: points at even distances in their order stand for the others.
constexpr std::size_t kSample = 65'536;
/// Left out at each end of a coordinate to find the middle: of a scan most of whose points lie on the axes,
/// or are one, the middle half may be nothing.
constexpr double kShares[] = {0.25, 0.1, 0.01};

/// What lies within reach of the middle; a point if the middle is one. `share`: of kShares. `sample`: not
/// empty.
[[nodiscard]] Box reachOf(PointCloud& sample, double share);

template <typename PointAt>
MainPart within(const Box& reach, std::size_t count, const PointAt& pointAt) {
    const auto holds = [](double low, double value, double high) { return value >= low && value <= high; };
    MainPart part;
    for (std::size_t i = 0; i < count; ++i) {
        const Point3 p = pointAt(i);
        if (holds(reach.low.x, p.x, reach.high.x) && holds(reach.low.y, p.y, reach.high.y) &&
            holds(reach.low.z, p.z, reach.high.z)) {
            part.box.add(p);
            ++part.points;
        }
    }
    part.outliers = count - part.points;
    return part;
}

}  // namespace main_part

/// Up to about a quarter of all points may be outliers, wherever they lie; less where the middle is a point.
/// `pointAt(i)` gives the finite points, `count` at least one. Does not depend on the order of up to kSample
/// points.
template <typename PointAt>
MainPart mainPartOf(std::size_t count, const PointAt& pointAt) {
    const std::size_t step = (count + main_part::kSample - 1) / main_part::kSample;
    PointCloud sample;
    for (std::size_t i = 0; i < count; i += step) sample.push_back(pointAt(i));
    std::optional<MainPart> point;
    for (const double share : main_part::kShares) {
        const MainPart part = main_part::within(main_part::reachOf(sample, share), count, pointAt);
        if (2 * part.points <= count) continue;
        if (!part.isPoint()) return part;
        point = part;
    }
    return point ? *point
                 : main_part::within({{-INFINITY, -INFINITY, -INFINITY}, {INFINITY, INFINITY, INFINITY}},
                                     count, pointAt);
}

inline MainPart mainPartOf(const PointCloud& points) {
    return mainPartOf(points.size(), [&](std::size_t i) { return points[i]; });
}

}  // namespace shapedb
