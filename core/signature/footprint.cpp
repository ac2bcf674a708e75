// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/signature/footprint.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include <Eigen/Eigenvalues>

#include "core/geometry/neighbours.h"

namespace shapedb {

namespace {

constexpr double kCellSpacings = 2.0;
constexpr double kLeastCell = 0.01;  // of the length
constexpr double kTail = 0.005;      // fraction of the points beyond either end of the length
constexpr std::size_t kProbes = 512;
constexpr std::size_t kNearest = 4;

struct Range {
    double low = 0.0;
    double length = 0.0;
};

// The range of the values without the tails: a few outlying points do not set the length.
Range spanOf(std::vector<double> values) {
    const auto at = [&](double share) {
        const auto n = std::lround(share * static_cast<double>(values.size() - 1));
        std::nth_element(values.begin(), values.begin() + n, values.end());
        return values[static_cast<std::size_t>(n)];
    };
    const double low = at(kTail);
    return {low, at(1.0 - kTail) - low};
}

// Typical distance of neighbouring points.
double spacingOf(const PointCloud& points) {
    const NeighbourIndex index(points);
    std::vector<Neighbour> found;
    std::vector<double> squared;
    const std::size_t step = std::max<std::size_t>(1, points.size() / kProbes);
    for (std::size_t i = 0; i < points.size(); i += step) {
        index.nearest(points[i], kNearest + 1, found);
        // The first is the point itself.
        for (std::size_t n = 1; n < found.size(); ++n) squared.push_back(found[n].squaredDistance);
    }
    const auto middle = squared.begin() + static_cast<std::ptrdiff_t>(squared.size() / 2);
    std::nth_element(squared.begin(), middle, squared.end());
    return std::sqrt(*middle);
}

// The points, projected onto the plane of their two longest principal axes.
std::vector<OutlinePoint> projected(const PointCloud& points) {
    const double unit = 1.0 / static_cast<double>(points.size());
    Point3 centre;
    for (const Point3& p : points) centre = centre + unit * p;
    Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
    for (const Point3& p : points) {
        const Eigen::Vector3d d(p.x - centre.x, p.y - centre.y, p.z - centre.z);
        moments += unit * d * d.transpose();
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(moments);
    const Eigen::Vector3d longest = solver.eigenvectors().col(2);
    const Eigen::Vector3d middle = solver.eigenvectors().col(1);
    std::vector<OutlinePoint> plane;
    plane.reserve(points.size());
    for (const Point3& p : points) {
        const Eigen::Vector3d d(p.x - centre.x, p.y - centre.y, p.z - centre.z);
        plane.push_back({longest.dot(d), middle.dot(d)});
    }
    return plane;
}

// The mean of the points of each cell.
std::vector<OutlinePoint> oneACell(const std::vector<OutlinePoint>& points, double cell) {
    using Key = std::pair<std::int64_t, std::int64_t>;
    const auto keyOf = [&](const OutlinePoint& p) {
        return Key{std::llround(std::floor(p[0] / cell)), std::llround(std::floor(p[1] / cell))};
    };
    std::vector<std::pair<Key, OutlinePoint>> sorted;
    sorted.reserve(points.size());
    for (const OutlinePoint& p : points) sorted.push_back({keyOf(p), p});
    // By place within the cell, too, so that its sum does not depend on the order of the points.
    std::sort(sorted.begin(), sorted.end());
    std::vector<OutlinePoint> cells;
    for (std::size_t begin = 0; begin < sorted.size();) {
        std::size_t end = begin;
        OutlinePoint sum{};
        for (; end < sorted.size() && sorted[end].first == sorted[begin].first; ++end) {
            sum[0] += sorted[end].second[0];
            sum[1] += sorted[end].second[1];
        }
        const double count = static_cast<double>(end - begin);
        cells.push_back({sum[0] / count, sum[1] / count});
        begin = end;
    }
    return cells;
}

// Along and across the principal axes of the cells themselves: those of the points depend on how many points
// lie over each cell.
void turnToAxes(std::vector<OutlinePoint>& cells) {
    const double unit = 1.0 / static_cast<double>(cells.size());
    OutlinePoint centre{};
    for (const OutlinePoint& c : cells) {
        centre[0] += unit * c[0];
        centre[1] += unit * c[1];
    }
    Eigen::Matrix2d moments = Eigen::Matrix2d::Zero();
    for (const OutlinePoint& c : cells) {
        const Eigen::Vector2d d(c[0] - centre[0], c[1] - centre[1]);
        moments += unit * d * d.transpose();
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d> solver(moments);
    const Eigen::Matrix2d& axes = solver.eigenvectors();
    for (OutlinePoint& c : cells) {
        const Eigen::Vector2d d(c[0] - centre[0], c[1] - centre[1]);
        c = {axes.col(1).dot(d), axes.col(0).dot(d)};
    }
}

Range lengthOf(const std::vector<OutlinePoint>& points) {
    std::vector<double> along;
    along.reserve(points.size());
    for (const OutlinePoint& p : points) along.push_back(p[0]);
    return spanOf(std::move(along));
}

}  // namespace

std::vector<OutlinePoint> footprint(const PointCloud& surface) {
    const std::vector<OutlinePoint> plane = projected(surface);
    const double length = lengthOf(plane).length;
    if (!(length > 0.0)) return {};
    std::vector<OutlinePoint> cells =
        oneACell(plane, std::max(kCellSpacings * spacingOf(surface), kLeastCell * length));
    turnToAxes(cells);
    const Range range = lengthOf(cells);
    if (!(range.length > 0.0)) return {};
    for (OutlinePoint& c : cells) c = {(c[0] - range.low) / range.length, c[1] / range.length};
    return cells;
}

}  // namespace shapedb
