// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/segmentation/widest_way.h"

#include <algorithm>
#include <limits>
#include <queue>
#include <utility>

#include "core/segmentation/interior_cost.h"

namespace shapedb {

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
