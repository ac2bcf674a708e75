// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/segmentation/contrast_merging.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>
#include <tuple>
#include <unordered_map>
#include <utility>

#include "core/base/disjoint_sets.h"
#include "core/base/return_if_error.h"
#include "core/geometry/tetrahedron.h"

namespace shapedb {

namespace {

constexpr std::size_t kMergesBetweenCheckpoints = 4096;

// A group's pairs are updated when its radius has moved by this share of itself.
constexpr double kRadiusDrift = 1e-3;

// Weight of a flat segment, as a share of all volume. Weights must not be 0, since they divide, and each must
// change any sum it enters: absorbLight knows outdated entries by their weights.
constexpr double kLeastWeight = 1e-12;

// The growing groups: radii, weights, and the saddle radii to their neighbours.
class Groups {
  public:
    using Saddles = std::vector<std::pair<std::uint32_t, double>>;

    explicit Groups(const SegmentGraph& graph)
        : sets_(graph.volumes.size()),
          weight_(graph.volumes),
          logRadius_(graph.volumes.size()),
          radius_(graph.volumes.size()),
          saddles_(graph.volumes.size()) {
        for (const double volume : graph.volumes) total_ += volume;
        const double least = std::max(kLeastWeight * total_, std::numeric_limits<double>::min());
        for (std::uint32_t i = 0; i < size(); ++i) {
            weight_[i] = std::max(weight_[i], least);
            logRadius_[i] = std::log(graph.radii[i]);
            radius_[i] = graph.radii[i];
        }
        for (const SegmentContact& c : graph.contacts) {
            saddles_[c.first][c.second] = c.saddleRadius;
            saddles_[c.second][c.first] = c.saddleRadius;
        }
    }

    std::uint32_t size() const { return static_cast<std::uint32_t>(sets_.size()); }
    double totalVolume() const { return total_; }
    bool isGroup(std::uint32_t i) const { return sets_.isRepresentative(i); }
    double weight(std::uint32_t group) const { return weight_[group]; }
    double logRadius(std::uint32_t group) const { return logRadius_[group]; }
    const std::unordered_map<std::uint32_t, double>& neighbours(std::uint32_t group) const {
        return saddles_[group];
    }

    double contrast(std::uint32_t a, std::uint32_t b, double saddleRadius) const {
        const auto [least, most] = std::minmax(radius_[a], radius_[b]);
        return most / std::min(least, saddleRadius);
    }

    std::uint32_t groupOf(std::uint32_t i) { return sets_.find(i); }

    // Joins two groups that touch. The one with fewer neighbours (or else less weight, or else the higher
    // index) goes into the other, so that few neighbours have to be moved. Returns the remaining group, and
    // its new neighbours with their saddle radii.
    std::pair<std::uint32_t, Saddles> join(std::uint32_t a, std::uint32_t b) {
        if (std::make_tuple(saddles_[a].size(), weight_[a], b) <
            std::make_tuple(saddles_[b].size(), weight_[b], a)) {
            std::swap(a, b);
        }
        const double weight = weight_[a] + weight_[b];
        logRadius_[a] = (weight_[a] * logRadius_[a] + weight_[b] * logRadius_[b]) / weight;
        radius_[a] = std::exp(logRadius_[a]);
        weight_[a] = weight;
        sets_.absorb(a, b);
        Saddles moved;
        saddles_[a].erase(b);
        // The order of a hash map makes no difference here or in the callers: each neighbour is handled apart
        // from the others, and the queues have a total order.
        for (const auto& [next, saddleRadius] : saddles_[b]) {
            if (next == a) continue;
            saddles_[next].erase(b);
            double& widest = saddles_[a][next];
            widest = std::max(widest, saddleRadius);
            saddles_[next][a] = widest;
            moved.emplace_back(next, widest);
        }
        saddles_[b] = {};
        return {a, std::move(moved)};
    }

  private:
    DisjointSets sets_;
    std::vector<double> weight_;
    // Means are taken of logarithms, since contrasts are ratios; the radii themselves save a call of exp for
    // every contrast.
    std::vector<double> logRadius_;
    std::vector<double> radius_;
    std::vector<std::unordered_map<std::uint32_t, double>> saddles_;
    double total_ = 0.0;
};

// A pair of groups waiting to merge. Equal contrasts are ordered by index, so that the order of pushing does
// not matter.
struct MergeCandidate {
    double contrast;
    std::uint32_t a;
    std::uint32_t b;
    bool operator<(const MergeCandidate& o) const {
        return std::tie(contrast, a, b) > std::tie(o.contrast, o.a, o.b);  // least first
    }
};

// Pairs that are most alike merge first. So a limb of many maxima becomes one group before it is compared
// with the body, and a limb much thinner than the body stays separate however wide its root.
Result<void> mergeAlike(Groups& groups, double limit, const RunContext& context) {
    std::priority_queue<MergeCandidate> queue;
    const auto consider = [&](std::uint32_t a, std::uint32_t b, double saddleRadius) {
        const double contrast = groups.contrast(a, b, saddleRadius);
        if (contrast <= limit) queue.push({contrast, std::min(a, b), std::max(a, b)});
    };
    std::vector<double> seenRadius(groups.size());
    for (std::uint32_t a = 0; a < groups.size(); ++a) {
        seenRadius[a] = groups.logRadius(a);
        for (const auto& [b, saddleRadius] : groups.neighbours(a)) {
            if (a < b) consider(a, b, saddleRadius);
        }
    }
    for (std::size_t step = 1; !queue.empty(); ++step) {
        if (step % kMergesBetweenCheckpoints == 0) {
            RETURN_IF_ERROR(context.checkpoint());
        }
        const MergeCandidate best = queue.top();
        queue.pop();
        if (!groups.isGroup(best.a) || !groups.isGroup(best.b)) continue;
        // Groups that touch once go on touching, so the entry exists.
        const double saddleRadius = groups.neighbours(best.a).at(best.b);
        // Entries stay in the queue when groups grow. Where the contrast has risen since, the pair goes back
        // to wait for its turn. Where it has fallen by more than the drift allows, a newer entry came up
        // before this.
        if (groups.contrast(best.a, best.b, saddleRadius) > best.contrast) {
            consider(best.a, best.b, saddleRadius);
            continue;
        }
        const auto [joined, moved] = groups.join(best.a, best.b);
        if (std::abs(groups.logRadius(joined) - seenRadius[joined]) > kRadiusDrift) {
            seenRadius[joined] = groups.logRadius(joined);
            for (const auto& [next, width] : groups.neighbours(joined)) consider(joined, next, width);
        } else {
            for (const auto& [next, width] : moved) consider(joined, next, width);
        }
    }
    return {};
}

std::uint32_t widestNeighbour(const Groups& groups, std::uint32_t group) {
    std::uint32_t best = group;
    double widest = -1.0;
    for (const auto& [next, saddleRadius] : groups.neighbours(group)) {
        if (saddleRadius > widest || (saddleRadius == widest && next < best)) {
            widest = saddleRadius;
            best = next;
        }
    }
    return best;
}

Result<void> absorbLight(Groups& groups, const ContrastMerging& options, const RunContext& context) {
    // Only groups that touch another: a separate lump can join none, and does not count towards the limit. A
    // MergeCandidate is one group here, with its weight as the contrast.
    std::priority_queue<MergeCandidate> lightest;
    for (std::uint32_t i = 0; i < groups.size(); ++i) {
        if (!groups.neighbours(i).empty()) lightest.push({groups.weight(i), i, 0});
    }
    std::size_t left = lightest.size();
    const double least = options.minShare * groups.totalVolume();
    for (std::size_t step = 1; !lightest.empty(); ++step) {
        if (step % kMergesBetweenCheckpoints == 0) {
            RETURN_IF_ERROR(context.checkpoint());
        }
        const MergeCandidate light = lightest.top();
        lightest.pop();
        // Weights only grow, so an entry with another weight is outdated.
        if (!groups.isGroup(light.a) || groups.weight(light.a) != light.contrast) continue;
        const bool tooMany = options.maxSegments > 0 && left > options.maxSegments;
        // All others are at least as heavy.
        if (light.contrast >= least && !tooMany) break;
        const std::uint32_t joined = groups.join(light.a, widestNeighbour(groups, light.a)).first;
        --left;
        if (groups.neighbours(joined).empty()) {
            --left;
        } else {
            lightest.push({groups.weight(joined), joined, 0});
        }
    }
    return {};
}

}  // namespace

Result<std::vector<std::uint32_t>> mergeByContrast(const SegmentGraph& graph, const ContrastMerging& options,
                                                   const RunContext& context) {
    Groups groups(graph);
    RETURN_IF_ERROR(mergeAlike(groups, options.contrast, context));
    RETURN_IF_ERROR(absorbLight(groups, options, context));
    std::vector<std::uint32_t> dense(groups.size(), groups.size());
    std::vector<std::uint32_t> result(groups.size());
    std::uint32_t count = 0;
    for (std::uint32_t i = 0; i < groups.size(); ++i) {
        std::uint32_t& index = dense[groups.groupOf(i)];
        if (index == groups.size()) index = count++;
        result[i] = index;
    }
    return result;
}

Result<SegmentLabels> mergeSegmentsByContrast(const PointCloud& points, const Tetrahedra& tetrahedra,
                                              const std::vector<std::uint8_t>& flow,
                                              const SegmentLabels& fine, const ContrastMerging& options,
                                              const RunContext& context) {
    SegmentGraph graph;
    auto contacts = segmentContacts(points, tetrahedra, flow, fine.ofTetrahedron, context);
    RETURN_IF_ERROR(contacts);
    graph.contacts = std::move(*contacts);
    graph.volumes.assign(fine.maxima.size(), 0.0);
    for (std::size_t t = 0; t < tetrahedra.size(); ++t) {
        const std::int32_t segment = fine.ofTetrahedron[t];
        if (segment < 0) continue;
        graph.volumes[static_cast<std::size_t>(segment)] +=
            std::max(0.0, signedVolume(cornersOf(points, tetrahedra.vertices[t])));
    }
    for (const std::uint32_t maximum : fine.maxima) graph.radii.push_back(tetrahedra.circumradii[maximum]);
    const auto groups = mergeByContrast(graph, options, context);
    RETURN_IF_ERROR(groups);
    // Fine segments come by falling maximum (islands last), so the first of a group holds its maximum.
    SegmentLabels merged;
    for (std::size_t s = 0; s < groups->size(); ++s) {
        if ((*groups)[s] == merged.maxima.size()) merged.maxima.push_back(fine.maxima[s]);
    }
    merged.ofTetrahedron.reserve(tetrahedra.size());
    for (const std::int32_t segment : fine.ofTetrahedron) {
        merged.ofTetrahedron.push_back(
            segment < 0 ? -1 : static_cast<std::int32_t>((*groups)[static_cast<std::size_t>(segment)]));
    }
    return merged;
}

}  // namespace shapedb
