// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/preparation/outliers.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <iterator>
#include <new>
#include <string>
#include <utility>

#include <Eigen/Core>
#include <Eigen/Eigenvalues>

#include "core/base/return_if_error.h"
#include "core/preparation/surroundings.h"

namespace shapedb {

namespace {

constexpr std::size_t kSurroundings = 12;  // enough to tell a surface from a haze
constexpr double kHazeReach = 2.5;
// Spread across the local plane over spread along it: below this on a surface, unless its radius of
// curvature is as small as its spacing.
constexpr double kHazeFlatness = 0.25;
constexpr double kSmallGroupShare = 0.01;
constexpr double kRareShare = 0.05;         // of the points: groups of like size hold less
constexpr std::size_t kFewestOfABody = 24;  // points; a smaller group shows no surface
constexpr std::size_t kCluster = 9;         // points; fewer are single outliers, not a cluster

bool standsOff(const Surroundings& around, std::size_t i, double ratio) {
    double sum = 0.0;
    for (std::size_t k = 0; k < kReachNeighbours; ++k) sum += around.reach[around.neighbour(i, k)];
    return around.reach[i] * static_cast<double>(kReachNeighbours) > ratio * sum;
}

bool liesInHaze(const PointCloud& points, const NeighbourIndex& index, const Point3& p,
                std::vector<Neighbour>& found) {
    index.nearest(p, kSurroundings, found);
    Eigen::Vector3d first = Eigen::Vector3d::Zero();
    Eigen::Matrix3d second = Eigen::Matrix3d::Zero();
    for (const Neighbour& n : found) {
        const Point3 d = points[n.point] - p;
        const Eigen::Vector3d e(d.x, d.y, d.z);
        first += e;
        second += e * e.transpose();
    }
    const double count = static_cast<double>(found.size());
    Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver;
    solver.computeDirect(second / count - first * first.transpose() / (count * count),
                         Eigen::EigenvaluesOnly);
    const double across = std::sqrt(std::max(0.0, solver.eigenvalues()[0]));
    return across > kHazeFlatness * std::sqrt(std::max(0.0, solver.eigenvalues()[1]));
}

// Which sizes of groups are those of debris: small, and rare among all groups.
class Debris {
  public:
    /// `sizes`: of all groups, in any order.
    Debris(std::vector<std::uint32_t> sizes, std::size_t points)
        : sizes_(std::move(sizes)), points_(static_cast<double>(points)) {
        std::sort(sizes_.begin(), sizes_.end());
        before_.push_back(0);
        for (const std::uint32_t size : sizes_) before_.push_back(before_.back() + size);
    }

    bool holds(std::uint32_t size) const {
        if (static_cast<double>(size) >= kSmallGroupShare * points_) return false;
        if (size < kFewestOfABody) return true;
        const auto rank = [&](auto at) { return static_cast<std::size_t>(at - sizes_.begin()); };
        const std::size_t from = rank(std::lower_bound(sizes_.begin(), sizes_.end(), (size + 1) / 2));
        const std::size_t to = rank(std::upper_bound(sizes_.begin(), sizes_.end(), 2 * size));
        return static_cast<double>(before_[to] - before_[from]) < kRareShare * points_;
    }

    /// Size of the group that the median point belongs to, points counted by size of their groups.
    std::size_t medianSize() const {
        const auto at = std::lower_bound(before_.begin() + 1, before_.end(), (before_.back() + 1) / 2);
        return sizes_[static_cast<std::size_t>(at - before_.begin()) - 1];
    }

  private:
    std::vector<std::uint32_t> sizes_;   // ascending
    std::vector<std::uint64_t> before_;  // points in all smaller groups
    double points_;
};

// A group: points connected by short links between neighbours.
void markDebris(const PointCloud& points, const Surroundings& around, Outliers& found) {
    std::vector<std::uint8_t>& outlier = found.isOutlier;
    DisjointSets groups = linkedGroups(points, around, outlier);
    std::vector<std::uint32_t> size(points.size(), 0);
    // An outlier is joined to nothing: it neither bridges two groups nor makes one large.
    for (std::uint32_t i = 0; i < points.size(); ++i) ++size[groups.find(i)];
    std::vector<std::uint32_t> sizes;
    std::copy_if(size.begin(), size.end(), std::back_inserter(sizes), [](std::uint32_t n) { return n > 0; });
    const Debris debris(std::move(sizes), points.size());
    found.bodyPoints = debris.medianSize();
    for (std::uint32_t i = 0; i < points.size(); ++i) {
        if (!debris.holds(size[groups.find(i)])) continue;
        outlier[i] = 1;
        // Each group has one representative.
        if (groups.find(i) == i && size[i] >= kCluster) ++found.clusters;
    }
}

Result<Outliers> findOutliersOrThrow(const PointCloud& points, const NeighbourIndex& index, double ratio,
                                     const RunContext& context) {
    Outliers outliers;
    outliers.isOutlier.assign(points.size(), 0);
    outliers.bodyPoints = points.size();
    if (points.size() <= kSurroundings) return outliers;
    const auto around = measureReaches(points, index, context);
    RETURN_IF_ERROR(around);
    std::vector<Neighbour> found;
    for (std::size_t i = 0; i < points.size(); ++i) {
        const bool farFromAll = around->reach[i] > kHazeReach * around->common;
        const bool outlying =
            standsOff(*around, i, ratio) || (farFromAll && liesInHaze(points, index, points[i], found));
        outliers.isOutlier[i] = outlying ? 1 : 0;
    }
    markDebris(points, *around, outliers);
    return outliers;
}

}  // namespace

Result<Outliers> findOutliers(const PointCloud& points, const NeighbourIndex& index, double ratio,
                              const RunContext& context) {
    try {
        return findOutliersOrThrow(points, index, ratio, context);
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::kOutOfMemory, "not enough memory to look for outliers among " +
                                                 std::to_string(points.size()) + " points");
    }
}

}  // namespace shapedb
