// Who lies near a point: a static k-d tree.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/geometry/point.h"

namespace shapedb {

struct Neighbour {
    double squaredDistance = 0.0;
    std::uint32_t point = 0;  ///< index into the points given to the index

    friend bool operator<(const Neighbour& a, const Neighbour& b) {
        if (a.squaredDistance != b.squaredDistance) return a.squaredDistance < b.squaredDistance;
        return a.point < b.point;
    }
};

/// Answers depend on the points and their order alone; equal distances go by index. Immutable
/// once built, so any number of threads may ask at once. Keeps its own copy of the points.
class NeighbourIndex {
  public:
    /// O(n log n), on the threads of the caller's arena. Points must be finite and at most 2^32 - 1.
    explicit NeighbourIndex(const PointCloud& points);

    /// The `count` points nearest to `query` (fewer when there are fewer), nearest first, into
    /// `found`, whose capacity is reused. A point of the cloud finds itself.
    void nearest(const Point3& query, std::size_t count, std::vector<Neighbour>& found) const;

    /// All points at most `radius` from `query`, in an order that depends on the tree, into `found`.
    void within(const Point3& query, double radius, std::vector<Neighbour>& found) const;

    /// The indices of all points in the order of the tree's leaves: neighbours in this order tend
    /// to be neighbours in space, so queries that follow it stay in the cache.
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

}  // namespace shapedb
