// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/segmentation/segments.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <utility>

#include "core/base/disjoint_sets.h"
#include "core/base/processor.h"
#include "core/base/radix_sort.h"
#include "core/base/return_if_error.h"
#include "core/geometry/tetrahedron.h"

namespace shapedb {

namespace {

constexpr std::size_t kStepsBetweenCheckpoints = 1 << 16;

// Exceeds any rounding of a circumradius.
constexpr double kRoundingMargin = 1.001;

// Non-negative numbers are in the order of their bits.
std::uint64_t orderOf(double number) {
    std::uint64_t bits = 0;
    std::memcpy(&bits, &number, sizeof bits);
    return bits;
}

// Stable: equal circumradii stay in order.
void sortByFallingRadius(const Tetrahedra& tetrahedra, std::vector<std::uint32_t>& indices) {
    LargeVector<KeyedIndex> keyed;
    keyed.reserve(indices.size());
    for (const std::uint32_t t : indices) keyed.push_back({~orderOf(tetrahedra.circumradii[t]), t});
    radixSortByKey(keyed);
    for (std::size_t i = 0; i < keyed.size(); ++i) indices[i] = keyed[i].index;
}

// In place of a label while there is none.
constexpr std::int32_t kOutside = -1;
constexpr std::int32_t kUnseen = -2;
constexpr std::int32_t kOnPath = -3;     // flow has no cycles; if it had, the path would end where it closes
constexpr std::int32_t kNoMaximum = -4;  // interior, flows into no maximum
constexpr std::int32_t kInLayer = -5;    // waits for its label in a layer of growth

// Gives a tetrahedron the label of the strongest maximum that it flows into, directly or not: the least label
// of the (at most) two tetrahedra it flows into, which are labelled first. The result is that of maxima
// claiming what flows into them, strongest first, but each tetrahedron is visited once.
class Downstream {
  public:
    Downstream(const Tetrahedra& tetrahedra, const std::vector<std::uint8_t>& flow,
               std::vector<std::int32_t>& labels)
        : tetrahedra_(tetrahedra), flow_(flow), labels_(labels) {}

    void follow(std::uint32_t t) {
        path_.clear();
        for (;;) {
            const auto& neighbours = tetrahedra_.neighbours[t];
            // Not 0, since a maximum has its label from the start.
            const unsigned way = flow_[t];
            const std::uint32_t first = neighbours[lowestBit(way)];
            // The same as the first where only one bit is set.
            const std::uint32_t second = neighbours[lowestBit(way & (way - 1) ? way & (way - 1) : way)];
            const std::int32_t a = labelOf(first);
            const std::int32_t b = labelOf(second);
            if (a == kUnseen || b == kUnseen) {
                labels_[t] = kOnPath;
                path_.push_back(t);
                t = a == kUnseen ? first : second;
                continue;
            }
            labels_[t] = stronger(a, b);
            if (path_.empty()) return;
            t = path_.back();
            path_.pop_back();
        }
    }

  private:
    static unsigned lowestBit(unsigned mask) { return static_cast<unsigned>(__builtin_ctz(mask)); }
    std::int32_t labelOf(std::uint32_t t) const { return t == kNoTetrahedron ? kOutside : labels_[t]; }
    // The smaller of those that are labels; the others are negative, hence large when taken as unsigned.
    static std::int32_t stronger(std::int32_t a, std::int32_t b) {
        const auto least =
            static_cast<std::int32_t>(std::min(static_cast<std::uint32_t>(a), static_cast<std::uint32_t>(b)));
        return least < 0 ? kNoMaximum : least;
    }

    const Tetrahedra& tetrahedra_;
    const std::vector<std::uint8_t>& flow_;
    std::vector<std::int32_t>& labels_;
    // Instead of recursion: a path can be too long for the call stack.
    std::vector<std::uint32_t> path_;
};

// Label of the labelled neighbour with the largest ball, -1 when there is none.
std::int32_t labelOfLargestNeighbour(const Tetrahedra& tetrahedra, const SegmentLabels& labels,
                                     std::uint32_t t) {
    // Without branches, since they would be unpredictable.
    std::int32_t label = -1;
    std::int64_t largest = -1;
    for (const std::uint32_t next : tetrahedra.neighbours[t]) {
        const std::uint32_t there = next == kNoTetrahedron ? t : next;  // t has no label
        const std::int32_t other = labels.ofTetrahedron[there];
        const std::int64_t none = other < 0 ? -1 : 0;
        const std::int64_t radius = static_cast<std::int64_t>(orderOf(tetrahedra.circumradii[there])) | none;
        // Of equal balls the first counts. The order of facets is canonical (delaunay.h).
        label = radius > largest ? other : label;
        largest = radius > largest ? radius : largest;
    }
    return label;
}

// A tetrahedron and its new label.
struct Labelling {
    std::uint32_t tetrahedron;
    std::int32_t label;
};

// Gives unlabelled tetrahedra next to labelled ones the label of the neighbour with the largest ball, one
// layer at a time so that the order of the tetrahedra does not matter. Each layer is found from the one
// before, so the time is linear in the leftovers.
class Growth {
  public:
    Growth(const Tetrahedra& tetrahedra, SegmentLabels& labels) : tetrahedra_(tetrahedra), labels_(labels) {}

    Result<void> grow(const std::vector<std::uint32_t>& leftovers, const RunContext& context) {
        choose(leftovers);
        while (!layer_.empty()) {
            RETURN_IF_ERROR(context.checkpoint());
            expand();
            choose(following_);
        }
        return {};
    }

  private:
    // The layer consists of the candidates that have a labelled neighbour.
    void choose(const std::vector<std::uint32_t>& candidates) {
        layer_.clear();
        for (std::size_t i = 0; i < candidates.size(); ++i) {
            if (i + kPrefetchFarDistance < candidates.size())
                prefetch(&tetrahedra_.neighbours[candidates[i + kPrefetchFarDistance]]);
            if (i + kPrefetchDistance < candidates.size()) fetchNeighbours(candidates[i + kPrefetchDistance]);
            const std::uint32_t t = candidates[i];
            const std::int32_t label = labelOfLargestNeighbour(tetrahedra_, labels_, t);
            if (label >= 0) layer_.push_back({t, label});
        }
    }

    // Labels the layer; its unlabelled neighbours are the next candidates.
    void expand() {
        following_.clear();
        // All labels first: no tetrahedron of this layer may become a candidate for the next.
        for (std::size_t i = 0; i < layer_.size(); ++i)
            labels_.ofTetrahedron[layer_[i].tetrahedron] = layer_[i].label;
        for (std::size_t i = 0; i < layer_.size(); ++i) {
            if (i + kPrefetchFarDistance < layer_.size())
                prefetch(&tetrahedra_.neighbours[layer_[i + kPrefetchFarDistance].tetrahedron]);
            if (i + kPrefetchDistance < layer_.size())
                fetchNeighbours(layer_[i + kPrefetchDistance].tetrahedron);
            for (const std::uint32_t next : tetrahedra_.neighbours[layer_[i].tetrahedron]) {
                if (next == kNoTetrahedron || labels_.ofTetrahedron[next] != kNoMaximum) continue;
                labels_.ofTetrahedron[next] = kInLayer;
                following_.push_back(next);
            }
        }
    }

    void fetchNeighbours(std::uint32_t t) const {
        for (const std::uint32_t next : tetrahedra_.neighbours[t]) {
            prefetch(labels_.ofTetrahedron.data() + next);
            prefetch(tetrahedra_.circumradii.data() + next);
        }
    }

    const Tetrahedra& tetrahedra_;
    SegmentLabels& labels_;
    std::vector<Labelling> layer_;
    std::vector<std::uint32_t> following_;
};

// Leftovers that no label reached: one segment per connected group, around its largest ball, which is the
// first of the group to come up.
void labelIslands(const Tetrahedra& tetrahedra, std::vector<std::uint32_t> leftovers, SegmentLabels& labels) {
    const auto labelled = [&](std::uint32_t t) { return labels.ofTetrahedron[t] >= 0; };
    leftovers.erase(std::remove_if(leftovers.begin(), leftovers.end(), labelled), leftovers.end());
    sortByFallingRadius(tetrahedra, leftovers);
    for (const std::uint32_t seed : leftovers) {
        if (labels.ofTetrahedron[seed] >= 0) continue;
        const auto segment = static_cast<std::int32_t>(labels.maxima.size());
        labels.maxima.push_back(seed);
        labels.ofTetrahedron[seed] = segment;
        std::vector<std::uint32_t> stack = {seed};
        while (!stack.empty()) {
            const std::uint32_t t = stack.back();
            stack.pop_back();
            for (const std::uint32_t next : tetrahedra.neighbours[t]) {
                if (next == kNoTetrahedron || labels.ofTetrahedron[next] != kNoMaximum) continue;
                labels.ofTetrahedron[next] = segment;
                stack.push_back(next);
            }
        }
    }
}

}  // namespace

Result<SegmentLabels> stableManifolds(const Tetrahedra& tetrahedra, const std::vector<std::uint8_t>& interior,
                                      const std::vector<std::uint8_t>& flow, const RunContext& context) {
    SegmentLabels labels;
    labels.ofTetrahedron.assign(tetrahedra.size(), kOutside);
    for (std::uint32_t t = 0; t < tetrahedra.size(); ++t) {
        if (!interior[t]) continue;
        labels.ofTetrahedron[t] = kUnseen;
        if (flow[t] == 0) labels.maxima.push_back(t);
    }
    sortByFallingRadius(tetrahedra, labels.maxima);
    for (std::size_t i = 0; i < labels.maxima.size(); ++i) {
        // Labels are ranks by falling radius: the smaller label is that of the stronger maximum.
        labels.ofTetrahedron[labels.maxima[i]] = static_cast<std::int32_t>(i);
    }
    std::size_t steps = 0;
    Downstream downstream(tetrahedra, flow, labels.ofTetrahedron);
    for (std::uint32_t t = 0; t < tetrahedra.size(); ++t) {
        if (++steps % kStepsBetweenCheckpoints == 0) {
            RETURN_IF_ERROR(context.checkpoint());
        }
        if (labels.ofTetrahedron[t] == kUnseen) downstream.follow(t);
    }
    std::vector<std::uint32_t> leftovers;
    for (std::uint32_t t = 0; t < tetrahedra.size(); ++t) {
        if (labels.ofTetrahedron[t] == kNoMaximum) leftovers.push_back(t);
    }
    RETURN_IF_ERROR(Growth(tetrahedra, labels).grow(leftovers, context));
    labelIslands(tetrahedra, std::move(leftovers), labels);
    return labels;
}

SegmentLabels mergeSegments(const PointCloud& points, const Tetrahedra& tetrahedra, SegmentLabels labels,
                            double mergeRatio) {
    // Segments come by falling radius, so a merged set is represented by the one with the largest maximum.
    DisjointSets sets(labels.maxima.size());
    std::vector<double> maximumRadii(labels.maxima.size());
    for (std::size_t s = 0; s < maximumRadii.size(); ++s)
        maximumRadii[s] = tetrahedra.circumradii[labels.maxima[s]];
    for (std::uint32_t t = 0; t < tetrahedra.size(); ++t) {
        const std::int32_t mine = labels.ofTetrahedron[t];
        if (mine < 0) continue;
        // A facet's circumcircle is no larger than the sphere it lies on, which rules out most tetrahedra
        // and facets without computing the circle.
        const double most = kRoundingMargin * mergeRatio * tetrahedra.circumradii[t];
        if (maximumRadii[static_cast<std::size_t>(mine)] > most) continue;
        for (std::size_t facet = 0; facet < 4; ++facet) {
            const std::uint32_t next = tetrahedra.neighbours[t][facet];
            const bool later = next > t && next != kNoTetrahedron;
            const std::int32_t other = labels.ofTetrahedron[later ? next : t];
            if (static_cast<unsigned>(other < 0) | static_cast<unsigned>(other == mine)) continue;
            const double higher = std::max(maximumRadii[static_cast<std::size_t>(mine)],
                                           maximumRadii[static_cast<std::size_t>(other)]);
            const auto a = static_cast<std::uint32_t>(mine);
            const auto b = static_cast<std::uint32_t>(other);
            // Segments in one set already need no circle.
            if (higher > most || sets.find(a) == sets.find(b)) continue;
            const double circle = circumradiusOf(facetCorners(points, tetrahedra.vertices[t], facet));
            if (higher <= mergeRatio * circle) sets.unite(a, b);
        }
    }
    std::vector<std::uint32_t> maxima;
    std::vector<std::int32_t> dense(labels.maxima.size(), -1);
    for (std::uint32_t s = 0; s < labels.maxima.size(); ++s) {
        if (!sets.isRepresentative(s)) continue;
        dense[s] = static_cast<std::int32_t>(maxima.size());
        maxima.push_back(labels.maxima[s]);
    }
    // A representative is the smallest of its set, so its entry is there and stays as it is.
    for (std::uint32_t s = 0; s < dense.size(); ++s) dense[s] = dense[sets.find(s)];
    for (std::int32_t& segment : labels.ofTetrahedron) {
        if (segment >= 0) segment = dense[static_cast<std::size_t>(segment)];
    }
    labels.maxima = std::move(maxima);
    return labels;
}

}  // namespace shapedb
