// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/core/segmentation/exact_balls.h"

#include <vector>

namespace shapedb {

namespace {

ExactPoint computeCentre(const Triangulated& cloud, std::size_t t) {
    const auto p = exactCorners(cloud, t);
    return CGAL::circumcenter(p[0], p[1], p[2], p[3]);
}

// By cloud and tetrahedron, of triangulatedClouds().
const std::vector<std::vector<ExactPoint>>& knownCentres() {
    static const std::vector<std::vector<ExactPoint>> all = [] {
        std::vector<std::vector<ExactPoint>> centres;
        for (const Triangulated& cloud : triangulatedClouds()) {
            centres.emplace_back();
            for (std::size_t t = 0; t < cloud.tetrahedra.size(); ++t) {
                centres.back().push_back(computeCentre(cloud, t));
            }
        }
        return centres;
    }();
    return all;
}

}  // namespace

std::array<ExactPoint, 4> exactCorners(const Triangulated& cloud, std::size_t t) {
    const auto corners = cornersOf(cloud, t);
    return {exact(corners[0]), exact(corners[1]), exact(corners[2]), exact(corners[3])};
}

ExactPoint exactCentre(const Triangulated& cloud, std::size_t t) {
    const auto& clouds = triangulatedClouds();
    for (std::size_t i = 0; i < clouds.size(); ++i) {
        if (&cloud == &clouds[i]) return knownCentres()[i][t];
    }
    return computeCentre(cloud, t);
}

}  // namespace shapedb
