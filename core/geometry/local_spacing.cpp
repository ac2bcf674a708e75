// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <utility>

#include "core/base/double2.h"
#include "core/base/large_block.h"
#include "core/base/parallel.h"
#include "core/base/return_if_error.h"
#include "core/geometry/box.h"
#include "core/geometry/neighbours.h"

namespace shapedb {

namespace {

// Points that follow one another on the curve form leaves, eight leaves a group, and boxes around leaves a
// tree. Each group searches the tree once, with a box around all its points and their farthest neighbour so
// far, and its leaves then share the leaves found. This beats a k-d tree, which must descend once per point.

constexpr std::size_t kNeighbours = 3;
constexpr std::size_t kPairs = 4;  // of points in a leaf
constexpr std::size_t kLanes = 2 * kPairs;
constexpr std::size_t kFan = 8;  // children of a node
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Consecutive points; infinitely far away where there are no more.
struct Leaf {
    std::array<double, kLanes> x;
    std::array<double, kLanes> y;
    std::array<double, kLanes> z;
};

Double2 pairAt(const std::array<double, kLanes>& lanes, std::size_t i) {
    return {lanes[2 * i], lanes[2 * i + 1]};
}

// The boxes of two nodes.
struct BoxPair {
    Double2 lowX, lowY, lowZ, highX, highY, highZ;
};

BoxPair together(const Box& a, const Box& b) {
    return {{a.low.x, b.low.x},   {a.low.y, b.low.y},   {a.low.z, b.low.z},
            {a.high.x, b.high.x}, {a.high.y, b.high.y}, {a.high.z, b.high.z}};
}

// Squared distances from both boxes of the pair to `box`, also with rounding no more than that of any two
// of their points.
Double2 squaredGaps(const BoxPair& boxes, const Box& box) {
    const Double2 x = greater(greater(boxes.lowX - box.high.x, Double2(box.low.x) - boxes.highX), 0.0);
    const Double2 y = greater(greater(boxes.lowY - box.high.y, Double2(box.low.y) - boxes.highY), 0.0);
    const Double2 z = greater(greater(boxes.lowZ - box.high.z, Double2(box.low.z) - boxes.highZ), 0.0);
    return x * x + y * y + z * z;
}

// Boxes of leaves, boxes of kFan of those, and so on up to one.
class BoxTree {
  public:
    explicit BoxTree(const PointCloud& points) : leaves_((points.size() + kLanes - 1) / kLanes) {
        std::vector<Box> boxes(leaves_.size());
        for (std::size_t at = 0; at < leaves_.size() * kLanes; ++at) {
            const bool none = at >= points.size();
            const Point3 p = none ? Point3{kInfinity, kInfinity, kInfinity} : points[at];
            Leaf& leaf = leaves_[at / kLanes];
            leaf.x[at % kLanes] = p.x;
            leaf.y[at % kLanes] = p.y;
            leaf.z[at % kLanes] = p.z;
            if (!none) boxes[at / kLanes].add(p);
        }
        levels_.push_back(std::move(boxes));
        while (levels_.back().size() > 1) {
            const std::vector<Box>& below = levels_.back();
            std::vector<Box> above((below.size() + kFan - 1) / kFan);
            for (std::size_t b = 0; b < below.size(); ++b) above[b / kFan].add(below[b]);
            levels_.push_back(std::move(above));
        }
        // An empty box, infinitely far away, completes the last pair.
        for (std::vector<Box>& level : levels_) level.resize((level.size() + 1) / 2 * 2);
        for (const std::vector<Box>& level : levels_) {
            std::vector<BoxPair> pairs;
            for (std::size_t b = 0; b < level.size(); b += 2)
                pairs.push_back(together(level[b], level[b + 1]));
            pairs_.push_back(std::move(pairs));
        }
    }

    const LargeVector<Leaf>& leaves() const { return leaves_; }
    const Box& boxOfLeaf(std::size_t leaf) const { return levels_.front()[leaf]; }

    // The leaves whose boxes are closer to `box` than `squared`.
    void leavesWithin(const Box& box, double squared, std::vector<std::uint32_t>& found) const {
        found.clear();
        visit(levels_.size() - 1, 0, box, squared, found);
    }

  private:
    // Visits the children of one node: kFan boxes of a level, from `pair` on.
    void visit(std::size_t level, std::size_t pair, const Box& box, double squared,
               std::vector<std::uint32_t>& found) const {
        const std::size_t end = std::min(pairs_[level].size(), pair + kFan / 2);
        for (; pair < end; ++pair) {
            const unsigned near = less(squaredGaps(pairs_[level][pair], box), squared);
            for (std::size_t i = 0; i < 2; ++i) {
                if ((near >> i & 1u) == 0) continue;
                const std::size_t node = 2 * pair + i;
                if (level == 0) {
                    found.push_back(static_cast<std::uint32_t>(node));
                } else {
                    visit(level - 1, node * kFan / 2, box, squared, found);
                }
            }
        }
    }

    LargeVector<Leaf> leaves_;
    std::vector<std::vector<Box>> levels_;  // of the leaves first
    std::vector<std::vector<BoxPair>> pairs_;
};

// For each point of a leaf, the squared distances to the nearest others seen so far, by rank.
struct Nearest {
    std::array<std::array<Double2, kPairs>, kNeighbours> squared;

    Nearest() {
        for (auto& lanes : squared) lanes.fill(kInfinity);
    }

    // Offers all points of `other`. Without branches; two pairs at a time, because each insertion into the
    // ranks is a chain of dependent operations.
    template <bool kSame>
    void offer(const Leaf& own, const Leaf& other) {
        for (std::size_t i = 0; i < kPairs; i += 2) offerTo<kSame>(own, other, i);
    }

    double reach(std::size_t count) const {
        double most = 0.0;
        for (std::size_t i = 0; i < count; ++i) most = std::max(most, at(kNeighbours - 1, i));
        return most;
    }

    double at(std::size_t rank, std::size_t point) const {
        const Double2 pair = squared[rank][point / 2];
        return point % 2 == 0 ? pair.low() : pair.high();
    }

  private:
    template <bool kSame>
    void offerTo(const Leaf& own, const Leaf& other, std::size_t i) {
        const Double2 ax = pairAt(own.x, i), ay = pairAt(own.y, i), az = pairAt(own.z, i);
        const Double2 bx = pairAt(own.x, i + 1), by = pairAt(own.y, i + 1), bz = pairAt(own.z, i + 1);
        Double2 a0 = squared[0][i], a1 = squared[1][i], a2 = squared[2][i];
        Double2 b0 = squared[0][i + 1], b1 = squared[1][i + 1], b2 = squared[2][i + 1];
        for (std::size_t j = 0; j < kLanes; ++j) {
            const Double2 x = other.x[j], y = other.y[j], z = other.z[j];
            Double2 a = squaredLength(ax - x, ay - y, az - z);
            Double2 b = squaredLength(bx - x, by - y, bz - z);
            if (kSame) {
                if (j / 2 == i) a = a + Double2(j % 2 == 0 ? kInfinity : 0.0, j % 2 == 0 ? 0.0 : kInfinity);
                if (j / 2 == i + 1)
                    b = b + Double2(j % 2 == 0 ? kInfinity : 0.0, j % 2 == 0 ? 0.0 : kInfinity);
            }
            rank(a, a0, a1, a2);
            rank(b, b0, b1, b2);
        }
        squared[0][i] = a0, squared[1][i] = a1, squared[2][i] = a2;
        squared[0][i + 1] = b0, squared[1][i + 1] = b1, squared[2][i + 1] = b2;
    }

    static Double2 squaredLength(Double2 x, Double2 y, Double2 z) { return x * x + y * y + z * z; }

    static void rank(Double2 d, Double2& first, Double2& second, Double2& third) {
        const Double2 afterFirst = greater(d, first);
        first = lesser(d, first);
        const Double2 afterSecond = greater(afterFirst, second);
        second = lesser(afterFirst, second);
        third = lesser(afterSecond, third);
    }
};

// Measures the points of kFan leaves, which share the search for leaves around them.
class GroupSpacings {
  public:
    GroupSpacings(const BoxTree& tree, std::vector<double>& spacings) : tree_(tree), spacings_(spacings) {}

    void measure(std::size_t group) {
        const std::size_t begin = group * kFan;
        const std::size_t end = std::min(begin + kFan, tree_.leaves().size());
        std::array<Nearest, kFan> nearest;
        Box box;
        double reach = 0.0;
        for (std::size_t leaf = begin; leaf < end; ++leaf) {
            Nearest& own = nearest[leaf - begin];
            own.offer<true>(tree_.leaves()[leaf], tree_.leaves()[leaf]);
            if (leaf > 0) offer(leaf, leaf - 1, own);
            if (leaf + 1 < tree_.leaves().size()) offer(leaf, leaf + 1, own);
            box.add(tree_.boxOfLeaf(leaf));
            reach = std::max(reach, own.reach(countOf(leaf)));
        }
        collectAround(box, reach);
        for (std::size_t leaf = begin; leaf < end; ++leaf) finish(leaf, nearest[leaf - begin]);
    }

  private:
    std::size_t countOf(std::size_t leaf) const { return std::min(kLanes, spacings_.size() - leaf * kLanes); }

    void offer(std::size_t leaf, std::size_t other, Nearest& own) const {
        own.offer<false>(tree_.leaves()[leaf], tree_.leaves()[other]);
    }

    void collectAround(const Box& box, double reach) {
        tree_.leavesWithin(box, reach, around_);
        boxes_.clear();
        if (around_.size() % 2 != 0) around_.push_back(around_.back());
        for (std::size_t i = 0; i < around_.size(); i += 2) {
            boxes_.push_back(together(tree_.boxOfLeaf(around_[i]), tree_.boxOfLeaf(around_[i + 1])));
        }
    }

    void finish(std::size_t leaf, Nearest& own) {
        const std::size_t count = countOf(leaf);
        const Box& box = tree_.boxOfLeaf(leaf);
        double reach = own.reach(count);
        for (std::size_t i = 0; i < boxes_.size(); ++i) {
            const unsigned near = less(squaredGaps(boxes_[i], box), reach);
            if (near == 0) continue;
            for (std::size_t k = 0; k < 2; ++k) {
                // Itself and its neighbours on the curve were offered before the search.
                const std::size_t other = around_[2 * i + k];
                if ((near >> k & 1u) == 0 || other + 1 - leaf <= 2) continue;
                if (k == 1 && around_[2 * i] == other) continue;
                offer(leaf, other, own);
            }
            reach = own.reach(count);
        }
        for (std::size_t i = 0; i < count; ++i) {
            double sum = 0.0;
            for (std::size_t rank = 0; rank < kNeighbours; ++rank) sum += std::sqrt(own.at(rank, i));
            spacings_[leaf * kLanes + i] = sum / static_cast<double>(kNeighbours);
        }
    }

    const BoxTree& tree_;
    std::vector<double>& spacings_;
    std::vector<std::uint32_t> around_;
    std::vector<BoxPair> boxes_;  // of those leaves
};

}  // namespace

Result<std::vector<double>> localSpacings(const PointCloud& points, const RunContext& context) {
    std::vector<double> spacings(points.size());
    if (points.empty()) return spacings;
    constexpr std::size_t kGroupsAtOnce = 64;
    const BoxTree tree(points);
    const std::size_t groups = (tree.leaves().size() + kFan - 1) / kFan;
    auto done = parallelFor(groups, kGroupsAtOnce, context, [&](std::size_t from, std::size_t to) {
        GroupSpacings measured(tree, spacings);
        for (std::size_t group = from; group < to; ++group) measured.measure(group);
    });
    RETURN_IF_ERROR(done);
    return spacings;
}

}  // namespace shapedb
