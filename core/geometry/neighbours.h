// SPDX-License-Identifier: GPL-3.0-or-later
// Nearest neighbours. Two structures, each for one use:
// - NeighbourIndex, a k-d tree, answers any query at any place.
// - localSpacings needs the three nearest neighbours of every point and nothing else. In Hilbert order,
//   groups of points share one search through a tree of boxes, four times as fast as the k-d tree, with
//   which a segmentation would take 5 to 15 % longer.
// The box tree does not replace the k-d tree, because sums over `within` run in the order of its leaves,
// and their bits enter signatures.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/geometry/point.h"

namespace shapedb {

struct Neighbour {
    double squaredDistance = 0.0;
    std::uint32_t point = 0;  ///< index into the points given

    friend bool operator<(const Neighbour& a, const Neighbour& b) {
        if (a.squaredDistance != b.squaredDistance) return a.squaredDistance < b.squaredDistance;
        return a.point < b.point;
    }
};

/// Keeps its own copy of the points. Immutable once built: any number of threads may query it. Answers
/// depend on the points and their order alone.
class NeighbourIndex {
  public:
    /// O(n log n), on the threads of the caller's arena. Points must be finite, and at most 2^32 - 1.
    explicit NeighbourIndex(const PointCloud& points);

    /// The `count` points nearest to `query` (all when there are fewer), nearest first, equal distances
    /// by index, into `found`, whose capacity is reused. A point of the cloud finds itself.
    void nearest(const Point3& query, std::size_t count, std::vector<Neighbour>& found) const;

    /// All points at most `radius` from `query`, in the order of the tree, into `found`.
    void within(const Point3& query, double radius, std::vector<Neighbour>& found) const;

    /// All points in the order of the tree's leaves: queries in this order stay in the cache.
    const std::vector<std::uint32_t>& order() const { return indices_; }

  private:
    struct Node {
        double split = 0.0;
        std::uint32_t begin = 0;  // of a leaf: its points; of an inner node: unused
        std::uint32_t end = 0;
        std::uint32_t right = 0;  // index of the second child; the first follows its parent; 0: a leaf
        std::uint8_t axis = 0;
    };

    static std::uint32_t nodesFor(std::uint32_t count);
    void build(const PointCloud& points, std::uint32_t at, std::uint32_t begin, std::uint32_t end);
    template <typename Visit, typename Reach>
    void search(std::uint32_t node, const Point3& query, Point3 offset, double squared, Visit& visit,
                Reach& reach) const;

    std::vector<Node> nodes_;
    std::vector<std::uint32_t> indices_;
    PointCloud points_;  // in the order of indices_
};

/// All points by distance from their centroid, nearest first: an order that no motion changes (up to
/// rounding). There must be a point.
[[nodiscard]] std::vector<Neighbour> byDistanceFromCentroid(const PointCloud& points);

/// For each point the mean distance to its three nearest other points (Section 2), in their unit; infinite
/// when there are fewer than three. Points should be in Hilbert order (core/delaunay/hilbert_order.h): the
/// result is the same in any order, but the time may grow with the square of their number. On the threads of
/// the caller's arena.
///
/// Errors: kCancelled, kDeadlineExceeded. May throw std::bad_alloc.
[[nodiscard]] Result<std::vector<double>> localSpacings(const PointCloud& points,
                                                        const RunContext& context = {});

}  // namespace shapedb
