// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/geometry/neighbours.h"

#include <algorithm>
#include <numeric>

#include "core/base/parallel.h"
#include "core/geometry/axis.h"
#include "core/geometry/box.h"

namespace shapedb {

namespace {

constexpr std::uint32_t kLeafSize = 10;
// With fewer points two threads are no faster than one.
constexpr std::uint32_t kLeastParallel = 4096;

void setCoordinate(Point3& p, int axis, double value) { (axis == 0 ? p.x : axis == 1 ? p.y : p.z) = value; }

int widestAxis(const PointCloud& points, const std::uint32_t* begin, const std::uint32_t* end) {
    Box box;
    for (const std::uint32_t* i = begin; i != end; ++i) box.add(points[*i]);
    const Point3 extent = box.extent();
    if (extent.x >= extent.y && extent.x >= extent.z) return 0;
    return extent.y >= extent.z ? 1 : 2;
}

}  // namespace

NeighbourIndex::NeighbourIndex(const PointCloud& points) : indices_(points.size()) {
    std::iota(indices_.begin(), indices_.end(), 0u);
    if (points.empty()) return;
    const auto count = static_cast<std::uint32_t>(points.size());
    nodes_.resize(nodesFor(count));
    build(points, 0, 0, count);
    points_.reserve(points.size());
    for (const std::uint32_t i : indices_) points_.push_back(points[i]);
}

// How many nodes a tree of `count` points has. Since halves are split at the median, nothing else
// decides it, so a subtree knows its place before its siblings are built.
std::uint32_t NeighbourIndex::nodesFor(std::uint32_t count) {
    // Level by level: `smaller` nodes of `size` points and `larger` nodes of one more.
    std::uint32_t nodes = 0;
    std::uint32_t size = count, smaller = 1, larger = 0;
    for (;;) {
        nodes += smaller + larger;
        if (size + 1 <= kLeafSize) return nodes;
        // The smaller nodes are leaves, the larger ones split once more.
        if (size <= kLeafSize) return nodes + 2 * larger;
        const bool even = size % 2 == 0;
        const std::uint32_t halves = even ? 2 * smaller + larger : smaller;
        larger = even ? larger : smaller + 2 * larger;
        smaller = halves;
        size /= 2;
    }
}

// Fills node `at` and its subtree, which follows it.
void NeighbourIndex::build(const PointCloud& points, std::uint32_t at, std::uint32_t begin,
                           std::uint32_t end) {
    nodes_[at] = {0.0, begin, end, 0, 0};
    if (end - begin <= kLeafSize) return;
    const int axis = widestAxis(points, indices_.data() + begin, indices_.data() + end);
    const std::uint32_t middle = begin + (end - begin) / 2;
    std::nth_element(indices_.begin() + begin, indices_.begin() + middle, indices_.begin() + end,
                     [&](std::uint32_t a, std::uint32_t b) {
                         const double x = coordinate(points[a], axis);
                         const double y = coordinate(points[b], axis);
                         return x != y ? x < y : a < b;
                     });
    const std::uint32_t right = at + 1 + nodesFor(middle - begin);
    nodes_[at].split = coordinate(points[indices_[middle]], axis);
    nodes_[at].right = right;
    nodes_[at].axis = static_cast<std::uint8_t>(axis);
    const auto left = [&] { build(points, at + 1, begin, middle); };
    const auto rest = [&] { build(points, right, middle, end); };
    if (end - begin < kLeastParallel) {
        left();
        rest();
    } else {
        parallelInvoke(left, rest);
    }
}

// Visits the points at most reach() (a squared distance, which may shrink on the way) from the query.
// `offset` leads from the query to the cell of `node`, `squared` is its squared length (Arya and Mount
// 1993: one coordinate of it changes from a node to its farther child).
template <typename Visit, typename Reach>
void NeighbourIndex::search(std::uint32_t node, const Point3& query, Point3 offset, double squared,
                            Visit& visit, Reach& reach) const {
    const Node& n = nodes_[node];
    if (n.right == 0) {
        for (std::uint32_t i = n.begin; i < n.end; ++i) {
            const double d = squaredDistance(points_[i], query);
            if (d <= reach()) visit({d, indices_[i]});
        }
        return;
    }
    const double beyond = n.split - coordinate(query, n.axis);
    const bool leftFirst = beyond > 0.0;
    search(leftFirst ? node + 1 : n.right, query, offset, squared, visit, reach);
    const double old = coordinate(offset, n.axis);
    const double there = squared - old * old + beyond * beyond;
    if (there > reach()) return;
    setCoordinate(offset, n.axis, beyond);
    search(leftFirst ? n.right : node + 1, query, offset, there, visit, reach);
}

void NeighbourIndex::nearest(const Point3& query, std::size_t count, std::vector<Neighbour>& found) const {
    found.clear();
    if (nodes_.empty() || count == 0) return;
    const auto visit = [&](const Neighbour& neighbour) {
        if (found.size() == count) {
            if (!(neighbour < found.front())) return;
            std::pop_heap(found.begin(), found.end());
            found.back() = neighbour;
        } else {
            found.push_back(neighbour);
        }
        std::push_heap(found.begin(), found.end());
    };
    const auto reach = [&] { return found.size() < count ? INFINITY : found.front().squaredDistance; };
    search(0, query, {}, 0.0, visit, reach);
    std::sort_heap(found.begin(), found.end());
}

void NeighbourIndex::within(const Point3& query, double radius, std::vector<Neighbour>& found) const {
    found.clear();
    if (nodes_.empty()) return;
    const auto visit = [&](const Neighbour& neighbour) { found.push_back(neighbour); };
    const auto reach = [squared = radius * radius] { return squared; };
    search(0, query, {}, 0.0, visit, reach);
}

std::vector<Neighbour> byDistanceFromCentroid(const PointCloud& points) {
    Point3 centroid;
    for (const Point3& p : points) centroid = centroid + p;
    centroid = (1.0 / static_cast<double>(points.size())) * centroid;
    std::vector<Neighbour> order(points.size());
    for (std::uint32_t i = 0; i < points.size(); ++i) {
        order[i] = {squaredDistance(points[i], centroid), i};
    }
    std::sort(order.begin(), order.end());
    return order;
}

}  // namespace shapedb
