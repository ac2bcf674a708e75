#include "core/segmentation/segments.h"

#include <algorithm>
#include <array>
#include <numeric>
#include <utility>

namespace shapedb {

namespace {

constexpr std::size_t kStepsBetweenCheckpoints = 1 << 16;

bool flowsThrough(std::uint8_t mask, std::size_t facet) { return ((mask >> facet) & 1u) != 0; }

// Facet of `to` behind which `from` lies.
std::size_t facetTowards(const Tetrahedra& tetrahedra, std::uint32_t to, std::uint32_t from) {
    const auto& neighbours = tetrahedra.neighbours[to];
    return static_cast<std::size_t>(std::find(neighbours.begin(), neighbours.end(), from) -
                                    neighbours.begin());
}

// By falling circumradius, equal ones by index.
void sortByFallingRadius(const Tetrahedra& tetrahedra, std::vector<std::uint32_t>& indices) {
    std::sort(indices.begin(), indices.end(), [&](std::uint32_t a, std::uint32_t b) {
        if (tetrahedra.circumradii[a] != tetrahedra.circumradii[b]) {
            return tetrahedra.circumradii[a] > tetrahedra.circumradii[b];
        }
        return a < b;
    });
}

// Claims for `segment` every unclaimed tetrahedron that flows into `sink`, directly or not.
Result<void> claim(const Tetrahedra& tetrahedra, const std::vector<std::uint8_t>& interior,
                   const std::vector<std::uint8_t>& flow, std::uint32_t sink, std::size_t& steps,
                   const RunContext& context, SegmentLabels& labels) {
    const auto segment = static_cast<std::int32_t>(labels.peaks.size());
    labels.peaks.push_back(sink);
    labels.ofTetrahedron[sink] = segment;
    std::vector<std::uint32_t> stack = {sink};
    while (!stack.empty()) {
        if (++steps % kStepsBetweenCheckpoints == 0) {
            if (auto go = context.checkpoint(); !go) return go;
        }
        const std::uint32_t t = stack.back();
        stack.pop_back();
        for (const std::uint32_t from : tetrahedra.neighbours[t]) {
            if (from == kNoTetrahedron || !interior[from] || labels.ofTetrahedron[from] >= 0) continue;
            if (!flowsThrough(flow[from], facetTowards(tetrahedra, from, t))) continue;
            labels.ofTetrahedron[from] = segment;
            stack.push_back(from);
        }
    }
    return {};
}

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
                if (next == kNoTetrahedron || !interior[next] || labels.ofTetrahedron[next] >= 0) continue;
                following.push_back(next);
            }
        }
        std::sort(following.begin(), following.end());
        following.erase(std::unique(following.begin(), following.end()), following.end());
        layer = std::move(following);
    }
    return {};
}

// Tetrahedra in reach of no maximum: one segment per connected group, around its largest ball.
void labelIslands(const Tetrahedra& tetrahedra, const std::vector<std::uint8_t>& interior,
                  std::vector<std::uint32_t> leftovers, SegmentLabels& labels) {
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
    labels.ofTetrahedron.assign(tetrahedra.size(), -1);
    std::vector<std::uint32_t> maxima;
    for (std::uint32_t t = 0; t < tetrahedra.size(); ++t) {
        if (interior[t] && flow[t] == 0) maxima.push_back(t);
    }
    sortByFallingRadius(tetrahedra, maxima);
    std::size_t steps = 0;
    for (const std::uint32_t maximum : maxima) {
        // Cospherical maxima cannot flow into each other, so none is claimed before its turn.
        if (auto go = claim(tetrahedra, interior, flow, maximum, steps, context, labels); !go) {
            return fail(go.error());
        }
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
