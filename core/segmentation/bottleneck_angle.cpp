// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/segmentation/bottleneck_angle.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>
#include <utility>

#include "core/base/return_if_error.h"
#include "core/geometry/tetrahedron.h"
#include "core/segmentation/interior_cost.h"

namespace shapedb {

namespace {

constexpr std::size_t kWalkedBetweenCheckpoints = 1 << 16;

}  // namespace

double facetCosine(const PointCloud& points, const Tetrahedra& tetrahedra, std::size_t tetrahedron,
                   std::size_t facet) {
    const auto& vertices = tetrahedra.vertices[tetrahedron];
    const Point3& shared = points[vertices[(facet + 1) % 4]];
    const Point3 here = tetrahedra.circumcentres[tetrahedron] - shared;
    const std::uint32_t next = tetrahedra.neighbours[tetrahedron][facet];
    // The centre of the infinite ball lies in the direction of the facet's normal.
    const double cosine =
        next == kNoTetrahedron
            ? dot(outwardNormal(points, vertices, facet), here) / tetrahedra.circumradii[tetrahedron]
            : dot(here, tetrahedra.circumcentres[next] - shared) /
                  (tetrahedra.circumradii[tetrahedron] * tetrahedra.circumradii[next]);
    // Rounding can take it past 1, where acos has no value.
    return std::clamp(cosine, -1.0, 1.0);
}

Result<std::vector<double>> bottleneckAngles(const PointCloud& points, const Tetrahedra& tetrahedra,
                                             const std::vector<std::uint8_t>& big,
                                             const RunContext& context) {
    // Dijkstra, with the largest edge of a path as its length: like a sum, it never falls as the path goes
    // on. Edges are -cosine, which grows with the angle, so that acos is taken of the results only.
    using Reached = std::pair<double, std::uint32_t>;
    constexpr double kUnreached = std::numeric_limits<double>::infinity();
    std::vector<double> best(tetrahedra.size(), kUnreached);
    std::priority_queue<Reached, std::vector<Reached>, std::greater<Reached>> queue;
    const auto offer = [&](std::uint32_t t, double value) {
        if (value >= best[t]) return;
        best[t] = value;
        queue.push({value, t});
    };
    for (std::uint32_t t = 0; t < tetrahedra.size(); ++t) {
        for (std::size_t facet = 0; big[t] && facet < 4; ++facet) {
            if (tetrahedra.neighbours[t][facet] == kNoTetrahedron) {
                offer(t, -facetCosine(points, tetrahedra, t, facet));
            }
        }
    }
    for (std::size_t steps = 1; !queue.empty(); ++steps) {
        if (steps % kWalkedBetweenCheckpoints == 0) {
            RETURN_IF_ERROR(context.checkpoint());
        }
        const auto [value, t] = queue.top();
        queue.pop();
        // Left over from before a better path to t was found: the queue has no way to lower an entry.
        if (value > best[t]) continue;
        for (std::size_t facet = 0; facet < 4; ++facet) {
            const std::uint32_t next = tetrahedra.neighbours[t][facet];
            if (next == kNoTetrahedron || !big[next] || best[next] <= value) continue;
            offer(next, std::max(value, -facetCosine(points, tetrahedra, t, facet)));
        }
    }
    for (double& value : best) {
        if (value < kUnreached) value = std::acos(-value);
    }
    return best;
}

std::vector<double> widestWays(const PointCloud& points, const Tetrahedra& tetrahedra,
                               const std::vector<double>& spacings, const std::vector<std::uint8_t>& inside) {
    std::vector<double> widest(tetrahedra.size(), -std::numeric_limits<double>::infinity());
    std::priority_queue<std::pair<double, std::uint32_t>> queue;
    const auto offer = [&](std::uint32_t t, double width) {
        if (width <= widest[t]) return;
        widest[t] = width;
        queue.push({width, t});
    };
    const auto widthOf = [&](std::uint32_t t, std::size_t facet) {
        return facetExtent(points, tetrahedra, t, facet, spacings).width;
    };
    const auto within = [&](std::uint32_t t) { return t != kNoTetrahedron && inside[t] != 0; };
    for (std::uint32_t t = 0; t < tetrahedra.size(); ++t) {
        for (std::size_t facet = 0; inside[t] != 0 && facet < 4; ++facet) {
            if (!within(tetrahedra.neighbours[t][facet])) offer(t, widthOf(t, facet));
        }
    }
    while (!queue.empty()) {
        const auto [width, t] = queue.top();
        queue.pop();
        if (width < widest[t]) continue;
        for (std::size_t facet = 0; facet < 4; ++facet) {
            const std::uint32_t next = tetrahedra.neighbours[t][facet];
            if (within(next)) offer(next, std::min(width, widthOf(t, facet)));
        }
    }
    return widest;
}

}  // namespace shapedb
