// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/signature/local_spread.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

#include <Eigen/Eigenvalues>

#include "core/base/random.h"
#include "core/geometry/neighbours.h"

namespace shapedb {

namespace {

constexpr std::uint64_t kSpreadSeed = 10;

// The first points of a random permutation, so the first few of these are a random choice as well.
PointCloud drawn(const PointCloud& points, std::size_t count) {
    PointCloud result = points;
    Random random(kSpreadSeed);
    count = std::min(count, result.size());
    for (std::size_t i = 0; i < count; ++i) std::swap(result[i], result[i + random.below(result.size() - i)]);
    result.resize(count);
    return result;
}

// Standard deviations along the principal axes, rising.
Eigen::Vector3d deviations(const PointCloud& points, const std::vector<Neighbour>& of) {
    const double unit = 1.0 / static_cast<double>(of.size());
    Point3 mean;
    for (const Neighbour& n : of) mean = mean + unit * points[n.point];
    Eigen::Matrix3d moments = Eigen::Matrix3d::Zero();
    for (const Neighbour& n : of) {
        const Point3 d = points[n.point] - mean;
        const Eigen::Vector3d v(d.x, d.y, d.z);
        moments += unit * v * v.transpose();
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(moments, Eigen::EigenvaluesOnly);
    // Rounding may push the least below zero.
    return solver.eigenvalues().cwiseMax(0.0).cwiseSqrt();
}

}  // namespace

std::vector<LocalSpread> localSpread(const PointCloud& surface) {
    const PointCloud points = drawn(surface, kSpreadNeighbours);
    const NeighbourIndex index(points);
    std::vector<Neighbour> near;
    std::vector<LocalSpread> result;
    for (std::size_t i = 0; i < std::min(kSpreadPlaces, points.size()); ++i) {
        index.within(points[i], kSpreadReach, near);
        const Eigen::Vector3d s = deviations(points, near);
        if (s[2] > 0.0) result.push_back({s[1] / s[2], s[0] / s[2]});
    }
    return result;
}

}  // namespace shapedb
