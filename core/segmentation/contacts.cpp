// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/segmentation/contacts.h"

#include <algorithm>
#include <cstddef>
#include <tuple>

#include "core/base/return_if_error.h"
#include "core/geometry/tetrahedron.h"

namespace shapedb {

namespace {

constexpr std::size_t kTetrahedraBetweenCheckpoints = 4096;

bool flowsTowards(const Tetrahedra& tetrahedra, const std::vector<std::uint8_t>& flow, std::uint32_t from,
                  std::uint32_t to) {
    for (std::size_t facet = 0; facet < 4; ++facet) {
        if (tetrahedra.neighbours[from][facet] == to) return ((flow[from] >> facet) & 1u) != 0;
    }
    return false;
}

// The smallest ball on the Voronoi edge between the circumcentres on both sides of a facet: the one around
// the facet's circumcircle where the edge crosses the facet, otherwise the smaller of the two at its ends.
double saddleRadiusAt(const PointCloud& points, const Tetrahedra& tetrahedra,
                      const std::vector<std::uint8_t>& flow, std::uint32_t t, std::size_t facet) {
    const std::uint32_t next = tetrahedra.neighbours[t][facet];
    const double smaller = std::min(tetrahedra.circumradii[t], tetrahedra.circumradii[next]);
    // Flow through the facet, either way, means that both centres lie on the same side of it. Then the radius
    // rises or falls all along the edge.
    if (((flow[t] >> facet) & 1u) != 0 || flowsTowards(tetrahedra, flow, next, t)) return smaller;
    return std::min(smaller, circumradiusOf(facetCorners(points, tetrahedra.vertices[t], facet)));
}

}  // namespace

Result<std::vector<SegmentContact>> segmentContacts(const PointCloud& points, const Tetrahedra& tetrahedra,
                                                    const std::vector<std::uint8_t>& flow,
                                                    const std::vector<std::int32_t>& labels,
                                                    const RunContext& context) {
    std::vector<SegmentContact> facets;
    for (std::uint32_t t = 0; t < tetrahedra.size(); ++t) {
        if (t % kTetrahedraBetweenCheckpoints == 0) {
            RETURN_IF_ERROR(context.checkpoint());
        }
        if (labels[t] < 0) continue;
        for (std::size_t facet = 0; facet < 4; ++facet) {
            // Each facet once. Which side comes first is random, so this is a selection, not a branch.
            const std::uint32_t next = tetrahedra.neighbours[t][facet];
            const std::int32_t other = labels[next > t && next != kNoTetrahedron ? next : t];
            if (other == labels[t] || other < 0) continue;
            const auto [low, high] = std::minmax(labels[t], other);
            facets.push_back({static_cast<std::uint32_t>(low), static_cast<std::uint32_t>(high),
                              saddleRadiusAt(points, tetrahedra, flow, t, facet),
                              areaOf(facetCorners(points, tetrahedra.vertices[t], facet))});
        }
    }
    // Stable, so that areas are summed in the order of the tetrahedra.
    std::stable_sort(facets.begin(), facets.end(), [](const SegmentContact& a, const SegmentContact& b) {
        return std::tie(a.first, a.second) < std::tie(b.first, b.second);
    });
    std::vector<SegmentContact> contacts;
    for (const SegmentContact& facet : facets) {
        if (contacts.empty() || contacts.back().first != facet.first ||
            contacts.back().second != facet.second) {
            contacts.push_back(facet);
            continue;
        }
        contacts.back().saddleRadius = std::max(contacts.back().saddleRadius, facet.saddleRadius);
        contacts.back().area += facet.area;
    }
    return contacts;
}

}  // namespace shapedb
