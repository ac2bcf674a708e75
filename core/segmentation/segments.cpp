#include "core/segmentation/segments.h"

#include <algorithm>
#include <array>
#include <limits>
#include <numeric>
#include <utility>

#include "core/base/fetch.h"

namespace shapedb {

namespace {

constexpr std::size_t kStepsBetweenCheckpoints = 1 << 16;

bool flowsThrough(std::uint8_t mask, std::size_t facet) { return ((mask >> facet) & 1u) != 0; }

// By falling circumradius, equal ones by index.
void sortByFallingRadius(const Tetrahedra& tetrahedra, std::vector<std::uint32_t>& indices) {
    std::vector<std::pair<double, std::uint32_t>> keyed;
    keyed.reserve(indices.size());
    for (const std::uint32_t t : indices) keyed.emplace_back(-tetrahedra.circumradii[t], t);
    std::sort(keyed.begin(), keyed.end());
    for (std::size_t i = 0; i < keyed.size(); ++i) indices[i] = keyed[i].second;
}

constexpr std::int32_t kUnseen = -2;
constexpr std::int32_t kOnPath = -3;  // flow has no cycles; if it had, the way would end where it closes
constexpr std::int32_t kNoMaximum = -1;
constexpr std::int32_t kInLayer = -4;  // of growing: gets its label with the layer it waits in

// Gives a tetrahedron the label of the strongest maximum that it flows into, directly or not: the least
// label of the two it may flow into, found before its own. What is left by maxima that claim what flows
// into them, strongest first, is the same; this way each tetrahedron is looked at once.
class Downstream {
  public:
    Downstream(const Tetrahedra& tetrahedra, const std::vector<std::uint8_t>& flow,
               std::vector<std::int32_t>& labels)
        : tetrahedra_(tetrahedra), flow_(flow), labels_(labels) {}

    void follow(std::uint32_t start) {
        path_.assign(1, start);
        while (!path_.empty()) {
            const std::uint32_t t = path_.back();
            if (labels_[t] != kUnseen && labels_[t] != kOnPath) {
                path_.pop_back();
                continue;
            }
            const bool first = labels_[t] == kUnseen;
            labels_[t] = kOnPath;
            std::int32_t least = std::numeric_limits<std::int32_t>::max();
            const std::size_t depth = path_.size();
            for (std::size_t facet = 0; facet < 4; ++facet) {
                if (!flowsThrough(flow_[t], facet)) continue;
                const std::uint32_t next = tetrahedra_.neighbours[t][facet];
                if (next == kNoTetrahedron) continue;
                if (first && labels_[next] == kUnseen) {
                    path_.push_back(next);
                    fetch(&tetrahedra_.neighbours[next]);
                    fetch(&flow_[next]);
                }
                if (labels_[next] >= 0) least = std::min(least, labels_[next]);
            }
            if (path_.size() > depth) continue;
            labels_[t] = least == std::numeric_limits<std::int32_t>::max() ? kNoMaximum : least;
            path_.pop_back();
        }
    }

  private:
    const Tetrahedra& tetrahedra_;
    const std::vector<std::uint8_t>& flow_;
    std::vector<std::int32_t>& labels_;
    std::vector<std::uint32_t> path_;
};

// Label of the labelled neighbour with the largest ball, -1 when there is none.
std::int32_t labelOfLargestNeighbour(const Tetrahedra& tetrahedra, const SegmentLabels& labels,
                                     std::uint32_t t) {
    std::int32_t label = -1;
    double largest = -1.0;
    for (const std::uint32_t next : tetrahedra.neighbours[t]) {
        if (next == kNoTetrahedron || labels.ofTetrahedron[next] < 0) continue;
        if (tetrahedra.circumradii[next] <= largest) continue;
        largest = tetrahedra.circumradii[next];
        label = labels.ofTetrahedron[next];
    }
    return label;
}

// Gives unlabelled tetrahedra next to labelled ones the label of the neighbour with the largest
// ball, one layer at a time so that the order of the tetrahedra does not matter. Each layer is
// found from the one before it: the time is that of one look at every leftover.
Result<void> growIntoLeftovers(const Tetrahedra& tetrahedra, const std::vector<std::uint8_t>& interior,
                               const std::vector<std::uint32_t>& leftovers, std::size_t& steps,
                               const RunContext& context, SegmentLabels& labels) {
    std::vector<std::uint32_t> layer;
    for (const std::uint32_t t : leftovers) {
        if (labelOfLargestNeighbour(tetrahedra, labels, t) >= 0) layer.push_back(t);
    }
    while (!layer.empty()) {
        std::vector<std::int32_t> chosen;
        chosen.reserve(layer.size());
        for (const std::uint32_t t : layer) {
            if (++steps % kStepsBetweenCheckpoints == 0) {
                if (auto go = context.checkpoint(); !go) return go;
            }
            chosen.push_back(labelOfLargestNeighbour(tetrahedra, labels, t));
        }
        for (std::size_t i = 0; i < layer.size(); ++i) labels.ofTetrahedron[layer[i]] = chosen[i];
        std::vector<std::uint32_t> following;
        for (const std::uint32_t t : layer) {
            for (const std::uint32_t next : tetrahedra.neighbours[t]) {
                if (next == kNoTetrahedron || !interior[next]) continue;
                if (labels.ofTetrahedron[next] != kNoMaximum) continue;
                labels.ofTetrahedron[next] = kInLayer;
                following.push_back(next);
            }
        }
        layer = std::move(following);
    }
    return {};
}

// Tetrahedra in reach of no maximum: one segment per connected group, around its largest ball.
void labelIslands(const Tetrahedra& tetrahedra, const std::vector<std::uint8_t>& interior,
                  std::vector<std::uint32_t> leftovers, SegmentLabels& labels) {
    const auto labelled = [&](std::uint32_t t) { return labels.ofTetrahedron[t] >= 0; };
    leftovers.erase(std::remove_if(leftovers.begin(), leftovers.end(), labelled), leftovers.end());
    sortByFallingRadius(tetrahedra, leftovers);
    for (const std::uint32_t seed : leftovers) {
        if (labels.ofTetrahedron[seed] >= 0) continue;
        const auto segment = static_cast<std::int32_t>(labels.peaks.size());
        labels.peaks.push_back(seed);
        labels.ofTetrahedron[seed] = segment;
        std::vector<std::uint32_t> stack = {seed};
        while (!stack.empty()) {
            const std::uint32_t t = stack.back();
            stack.pop_back();
            for (const std::uint32_t next : tetrahedra.neighbours[t]) {
                if (next == kNoTetrahedron || !interior[next] || labels.ofTetrahedron[next] >= 0) continue;
                labels.ofTetrahedron[next] = segment;
                stack.push_back(next);
            }
        }
    }
}

// Union by smaller index: the representative is the segment with the largest peak.
class DisjointSets {
  public:
    explicit DisjointSets(std::size_t count) : parent_(count) {
        std::iota(parent_.begin(), parent_.end(), 0);
    }
    std::int32_t find(std::int32_t i) {
        while (at(i) != i) i = at(i) = at(at(i));
        return i;
    }
    void unite(std::int32_t a, std::int32_t b) {
        a = find(a);
        b = find(b);
        at(std::max(a, b)) = std::min(a, b);
    }

  private:
    std::int32_t& at(std::int32_t i) { return parent_[static_cast<std::size_t>(i)]; }
    std::vector<std::int32_t> parent_;
};

}  // namespace

Result<SegmentLabels> stableManifolds(const Tetrahedra& tetrahedra, const std::vector<std::uint8_t>& interior,
                                      const std::vector<std::uint8_t>& flow, const RunContext& context) {
    SegmentLabels labels;
    labels.ofTetrahedron.assign(tetrahedra.size(), kNoMaximum);
    for (std::uint32_t t = 0; t < tetrahedra.size(); ++t) {
        if (!interior[t]) continue;
        labels.ofTetrahedron[t] = kUnseen;
        if (flow[t] == 0) labels.peaks.push_back(t);
    }
    sortByFallingRadius(tetrahedra, labels.peaks);
    for (std::size_t i = 0; i < labels.peaks.size(); ++i) {
        labels.ofTetrahedron[labels.peaks[i]] = static_cast<std::int32_t>(i);
    }
    std::size_t steps = 0;
    Downstream downstream(tetrahedra, flow, labels.ofTetrahedron);
    for (std::uint32_t t = 0; t < tetrahedra.size(); ++t) {
        if (++steps % kStepsBetweenCheckpoints == 0) {
            if (auto go = context.checkpoint(); !go) return fail(go.error());
        }
        if (labels.ofTetrahedron[t] == kUnseen) downstream.follow(t);
    }
    std::vector<std::uint32_t> leftovers;
    for (std::uint32_t t = 0; t < tetrahedra.size(); ++t) {
        if (interior[t] && labels.ofTetrahedron[t] < 0) leftovers.push_back(t);
    }
    if (auto go = growIntoLeftovers(tetrahedra, interior, leftovers, steps, context, labels); !go) {
        return fail(go.error());
    }
    labelIslands(tetrahedra, interior, std::move(leftovers), labels);
    return labels;
}

double facetCircumradius(const PointCloud& points, const Tetrahedra& tetrahedra, std::size_t t, int facet) {
    std::array<Point3, 3> p;
    for (int k = 1; k < 4; ++k) {
        p[static_cast<std::size_t>(k - 1)] =
            points[tetrahedra.vertices[t][static_cast<std::size_t>((facet + k) % 4)]];
    }
    const Point3 a = p[1] - p[0];
    const Point3 b = p[2] - p[0];
    // R = |a| |b| |a - b| / (2 |a x b|): infinite for three points on a line.
    return length(a) * length(b) * length(a - b) / (2.0 * length(cross(a, b)));
}

SegmentLabels mergeSegments(const PointCloud& points, const Tetrahedra& tetrahedra,
                            const SegmentLabels& labels, double mergeRatio) {
    DisjointSets sets(labels.peaks.size());
    const auto peakRadius = [&](std::int32_t segment) {
        return tetrahedra.circumradii[labels.peaks[static_cast<std::size_t>(segment)]];
    };
    for (std::uint32_t t = 0; t < tetrahedra.size(); ++t) {
        const std::int32_t mine = labels.ofTetrahedron[t];
        if (mine < 0) continue;
        for (std::size_t facet = 0; facet < 4; ++facet) {
            const std::uint32_t next = tetrahedra.neighbours[t][facet];
            if (next == kNoTetrahedron || next < t) continue;
            const std::int32_t other = labels.ofTetrahedron[next];
            if (other < 0 || other == mine || sets.find(other) == sets.find(mine)) continue;
            const double limit =
                mergeRatio * facetCircumradius(points, tetrahedra, t, static_cast<int>(facet));
            if (peakRadius(mine) <= limit && peakRadius(other) <= limit) sets.unite(mine, other);
        }
    }
    SegmentLabels merged;
    std::vector<std::int32_t> dense(labels.peaks.size(), -1);
    for (std::size_t s = 0; s < labels.peaks.size(); ++s) {
        if (sets.find(static_cast<std::int32_t>(s)) != static_cast<std::int32_t>(s)) continue;
        dense[s] = static_cast<std::int32_t>(merged.peaks.size());
        merged.peaks.push_back(labels.peaks[s]);
    }
    merged.ofTetrahedron.reserve(tetrahedra.size());
    for (const std::int32_t segment : labels.ofTetrahedron) {
        merged.ofTetrahedron.push_back(segment < 0 ? -1
                                                   : dense[static_cast<std::size_t>(sets.find(segment))]);
    }
    return merged;
}

}  // namespace shapedb
