// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/fit/surface_points.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <new>
#include <string>
#include <utility>

#include <Eigen/Eigenvalues>

#include "core/base/disjoint_sets.h"
#include "core/base/return_if_error.h"
#include "core/fit/cell_means.h"
#include "core/geometry/axis.h"
#include "core/geometry/box.h"
#include "core/geometry/neighbours.h"
#include "core/preparation/frame.h"
#include "core/preparation/sanitise.h"

namespace shapedb {

namespace {

constexpr std::size_t kNormalNeighbours = 10;

// Clusters: surface points closer than kLinkSpacings typical distances to the kLinkNeighbour-th neighbour
// belong together.
constexpr std::size_t kLinkNeighbour = 4;
constexpr double kLinkSpacings = 2.5;
constexpr double kLeastClusterShare = 0.02;

// Which cells belong to clusters worth keeping; all when there is nothing to leave out.
std::vector<std::uint8_t> keptCells(const std::vector<CellMean>& cells) {
    PointCloud means;
    for (const CellMean& cell : cells) means.push_back(cell.mean);
    std::vector<std::uint8_t> kept(cells.size(), 1);
    if (means.size() <= kLinkNeighbour + 1) return kept;
    const NeighbourIndex index(means);
    std::vector<double> reach;
    std::vector<Neighbour> found;
    for (const Point3& p : means) {
        index.nearest(p, kLinkNeighbour + 1, found);
        reach.push_back(found.back().squaredDistance);
    }
    std::nth_element(reach.begin(), reach.begin() + static_cast<std::ptrdiff_t>(reach.size() / 2),
                     reach.end());
    const double link = kLinkSpacings * std::sqrt(reach[reach.size() / 2]);
    DisjointSets clusters(means.size());
    for (std::uint32_t i = 0; i < means.size(); ++i) {
        index.within(means[i], link, found);
        for (const Neighbour& n : found) clusters.unite(i, n.point);
    }
    std::vector<std::uint64_t> weight(means.size(), 0);
    std::uint64_t total = 0;
    for (std::uint32_t i = 0; i < means.size(); ++i) {
        weight[clusters.find(i)] += cells[i].count;
        total += cells[i].count;
    }
    std::uint64_t left = 0;
    for (std::uint32_t i = 0; i < means.size(); ++i) {
        const double share = static_cast<double>(weight[clusters.find(i)]) / static_cast<double>(total);
        kept[i] = share >= kLeastClusterShare ? 1 : 0;
        left += kept[i] != 0 ? cells[i].count : 0;
    }
    // A scan of nothing but crumbs is kept as it is.
    if (2 * left < total) std::fill(kept.begin(), kept.end(), std::uint8_t{1});
    return kept;
}

// Starts with the point farthest from the centroid; equal distances by position, so that the order of the
// scan does not matter.
PointCloud inFarthestPointOrder(PointCloud points) {
    std::sort(points.begin(), points.end(), lexicographicLess);
    points.erase(std::unique(points.begin(), points.end()), points.end());
    Point3 centroid;
    for (const Point3& p : points) centroid = centroid + p;
    centroid = (1.0 / static_cast<double>(points.size())) * centroid;
    std::vector<double> gap(points.size(), INFINITY);
    std::size_t next = 0;
    double farthest = -1.0;
    for (std::size_t i = 0; i < points.size(); ++i) {
        const double d = squaredDistance(points[i], centroid);
        if (d > farthest) {
            farthest = d;
            next = i;
        }
    }
    PointCloud ordered;
    while (ordered.size() < points.size()) {
        const Point3 chosen = points[next];
        ordered.push_back(chosen);
        gap[next] = -1.0;
        farthest = -1.0;
        for (std::size_t i = 0; i < points.size(); ++i) {
            if (gap[i] < 0.0) continue;
            gap[i] = std::min(gap[i], squaredDistance(points[i], chosen));
            if (gap[i] > farthest) {
                farthest = gap[i];
                next = i;
            }
        }
    }
    return ordered;
}

Point3 normalOf(const std::vector<Neighbour>& neighbours, const PointCloud& points) {
    Point3 mean;
    for (const Neighbour& n : neighbours) mean = mean + points[n.point];
    mean = (1.0 / static_cast<double>(neighbours.size())) * mean;
    Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
    for (const Neighbour& n : neighbours) {
        const Point3 d = points[n.point] - mean;
        const Eigen::Vector3d v(d.x, d.y, d.z);
        spread += v * v.transpose();
    }
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(spread);
    const Eigen::Vector3d least = solver.eigenvectors().col(0);
    return {least.x(), least.y(), least.z()};
}

std::int16_t toStep(double value) {
    const double step = std::nearbyint(value * kSurfaceSteps);
    return static_cast<std::int16_t>(std::clamp<double>(step, -kSurfaceSteps, kSurfaceSteps));
}

Result<void> checkNotOnALine(const PointCloud& points) {
    const auto spread = checkNotFlat(points);
    if (!spread && spread.error().code == ErrorCode::kCollinear) return spread;
    return {};
}

Result<SurfacePoints> makeOrThrow(const PointCloud& scan, const RunContext& context) {
    context.report("surface", 0, 0);
    const auto frame = frameOf(scan);
    RETURN_IF_ERROR(frame);
    PointCloud scaled;
    scaled.reserve(scan.size());
    for (const Point3& p : scan) scaled.push_back((1.0 / frame->unit) * (p - frame->centre));
    RETURN_IF_ERROR(context.checkpoint());
    auto means = cellMeans(scaled, kMostSurfacePoints, context);
    RETURN_IF_ERROR(means);
    const std::vector<std::uint8_t> kept = keptCells(means->cells);
    RETURN_IF_ERROR(context.checkpoint());
    if (std::find(kept.begin(), kept.end(), std::uint8_t{0}) != kept.end()) {
        PointCloud left;
        for (std::size_t i = 0; i < scaled.size(); ++i) {
            if (kept[means->cellOfPoint[i]] != 0) left.push_back(scaled[i]);
        }
        scaled = std::move(left);
        means = cellMeans(scaled, kMostSurfacePoints, context);
        RETURN_IF_ERROR(means);
    }
    PointCloud points;
    for (const CellMean& cell : means->cells) points.push_back(cell.mean);
    points = inFarthestPointOrder(std::move(points));
    if (points.size() < 4) {
        return fail(ErrorCode::kTooFewPoints, "only " + std::to_string(points.size()) + " of " +
                                                  std::to_string(scan.size()) +
                                                  " points are distinct; at least 4 are needed");
    }
    RETURN_IF_ERROR(checkNotOnALine(points));
    RETURN_IF_ERROR(context.checkpoint());

    const Box box = boxOf(points);
    const Point3 half = 0.5 * box.extent();
    const double unit = std::max({half.x, half.y, half.z});
    const Point3 centre = 0.5 * (box.low + box.high);
    SurfacePoints surface;
    surface.unit = frame->unit * unit;
    surface.centre = frame->centre + frame->unit * centre;
    const NeighbourIndex index(points);
    std::vector<Neighbour> found;
    for (const Point3& p : points) {
        const Point3 inFrame = (1.0 / unit) * (p - centre);
        index.nearest(p, kNormalNeighbours + 1, found);
        surface.points.push_back(
            {{toStep(inFrame.x), toStep(inFrame.y), toStep(inFrame.z)}, packNormal(normalOf(found, points))});
    }
    return surface;
}

}  // namespace

void moveBy(const Point3& offset, SurfacePoints& surface) {
    // Not even the sign of a zero changes for nothing.
    if (offset != Point3{}) surface.centre = surface.centre + offset;
}

Point3 SurfacePoints::position(std::size_t i) const {
    const auto& p = points[i].position;
    const double step = unit / kSurfaceSteps;
    return centre + Point3{step * p[0], step * p[1], step * p[2]};
}

Point3 SurfacePoints::normal(std::size_t i) const { return unpackNormal(points[i].normal); }

// Octahedral projection: onto |x| + |y| + |z| = 1, seen along z. Since n and -n are the same normal, the
// lower half is never needed.
std::array<std::int8_t, 2> packNormal(const Point3& normal) {
    const bool down =
        normal.z < 0.0 || (normal.z == 0.0 && (normal.y < 0.0 || (normal.y == 0.0 && normal.x < 0.0)));
    const Point3 n = down ? -1.0 * normal : normal;
    const double sum = std::abs(n.x) + std::abs(n.y) + std::abs(n.z);
    // The upper half is a square standing on its corner: turned by 45 degrees it fills the range.
    const double u = (n.x + n.y) / sum;
    const double v = (n.x - n.y) / sum;
    const auto step = [](double value) {
        return static_cast<std::int8_t>(std::clamp(std::nearbyint(127.0 * value), -127.0, 127.0));
    };
    return {step(u), step(v)};
}

Point3 unpackNormal(const std::array<std::int8_t, 2>& packed) {
    const double u = packed[0] / 127.0;
    const double v = packed[1] / 127.0;
    const Point3 n{0.5 * (u + v), 0.5 * (u - v), 1.0 - std::max(std::abs(u), std::abs(v))};
    return (1.0 / length(n)) * n;
}

Result<SurfacePoints> makeSurfacePoints(const PointCloud& scan, const RunContext& context) {
    try {
        return makeOrThrow(scan, context);
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::kOutOfMemory,
                    "not enough memory for the surface of " + std::to_string(scan.size()) + " points");
    }
}

}  // namespace shapedb
