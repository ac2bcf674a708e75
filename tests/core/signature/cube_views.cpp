// SPDX-License-Identifier: GPL-3.0-or-later
#include "tests/core/signature/cube_views.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>

#include "core/base/random.h"
#include "core/delaunay/delaunay.h"
#include "core/geometry/motion.h"
#include "core/geometry/tetrahedron.h"

namespace shapedb::testing_support {

namespace {

using Face = std::array<std::uint32_t, 3>;

void joinFaces(InteriorView& view) {
    std::map<Face, std::pair<std::uint32_t, std::size_t>> open;
    const std::array<std::uint32_t, 4> none{kNoTetrahedron, kNoTetrahedron, kNoTetrahedron, kNoTetrahedron};
    view.neighbours.assign(view.vertices.size(), none);
    for (std::uint32_t t = 0; t < view.vertices.size(); ++t) {
        for (std::size_t f = 0; f < 4; ++f) {
            Face face;
            for (std::size_t v = 0, n = 0; v < 4; ++v) {
                if (v != f) face[n++] = view.vertices[t][v];
            }
            std::sort(face.begin(), face.end());
            const auto found = open.find(face);
            if (found == open.end()) {
                open[face] = {t, f};
                continue;
            }
            view.neighbours[t][f] = found->second.first;
            view.neighbours[found->second.first][found->second.second] = t;
        }
    }
}

void takeSurface(InteriorView& view) {
    view.surface = view.sites;
    if (view.surface.size() > 400) view.surface.resize(400);
    double sum = 0.0;
    for (const Point3& p : view.surface) {
        for (const Point3& q : view.surface) sum += distance(p, q);
    }
    const double n = static_cast<double>(view.surface.size());
    view.meanSurfaceDistance = sum / (n * (n - 1.0));
}

void measure(InteriorView& view, double side) {
    Random random(78);
    for (const auto& v : view.vertices) {
        Point3 centroid;
        for (const std::uint32_t site : v) centroid = centroid + 0.25 * view.sites[site];
        view.centroids.push_back(centroid);
        view.volumes.push_back(side * side * side / 6.0);
        // Any thickness will do; with a different one for each, wrong indices show.
        view.radii.push_back(side * random.uniform(0.2, 4.0));
        view.meanRadius += length(centroid) / static_cast<double>(view.vertices.size());
    }
    view.volume = std::accumulate(view.volumes.begin(), view.volumes.end(), 0.0);
}

}  // namespace

std::vector<Cube> cubeBlock(const Cube& first, const Cube& last) {
    std::vector<Cube> cubes;
    for (int x = first[0]; x < last[0]; ++x) {
        for (int y = first[1]; y < last[1]; ++y) {
            for (int z = first[2]; z < last[2]; ++z) cubes.push_back({x, y, z});
        }
    }
    return cubes;
}

std::vector<Cube> together(std::vector<Cube> a, const std::vector<Cube>& b) {
    a.insert(a.end(), b.begin(), b.end());
    std::sort(a.begin(), a.end());
    a.erase(std::unique(a.begin(), a.end()), a.end());
    return a;
}

std::vector<Cube> horseshoe(int length, int thick, int gap) {
    const auto arm = cubeBlock({0, 0, 0}, {length, thick, thick});
    const auto other = cubeBlock({0, thick + gap, 0}, {length, 2 * thick + gap, thick});
    return together(together(arm, other), cubeBlock({0, 0, 0}, {thick, 2 * thick + gap, thick}));
}

InteriorView viewOfCubes(const std::vector<Cube>& cubes, double side) {
    InteriorView view;
    Point3 middle;
    for (const Cube& c : cubes) {
        middle =
            middle + (1.0 / static_cast<double>(cubes.size())) * Point3{c[0] + 0.5, c[1] + 0.5, c[2] + 0.5};
    }
    Random random(5);
    const Matrix3 turn = randomRotation(random);
    std::map<Cube, std::uint32_t> corners;
    const auto corner = [&](const Cube& c) {
        const auto [at, fresh] = corners.try_emplace(c, static_cast<std::uint32_t>(view.sites.size()));
        const Point3 p{static_cast<double>(c[0]), static_cast<double>(c[1]), static_cast<double>(c[2])};
        if (fresh) view.sites.push_back(rotate(turn, side * (p - middle)));
        return at->second;
    };
    for (const Cube& c : cubes) {
        // One tetrahedron for each order of axes on a path from corner to opposite corner (Kuhn).
        std::array<std::size_t, 3> axes{0, 1, 2};
        do {
            std::array<std::uint32_t, 4> vertices;
            Cube at = c;
            vertices[0] = corner(at);
            for (std::size_t step = 0; step < 3; ++step) {
                ++at[axes[step]];
                vertices[step + 1] = corner(at);
            }
            if (sixfoldVolume(cornersOf(view.sites, vertices)) < 0.0) std::swap(vertices[2], vertices[3]);
            view.vertices.push_back(vertices);
        } while (std::next_permutation(axes.begin(), axes.end()));
    }
    joinFaces(view);
    measure(view, side);
    takeSurface(view);
    return view;
}

Point3 randomPointIn(const InteriorView& view, std::size_t t, Random& random) {
    const auto& vertices = view.vertices[t];
    std::array<double, 4> share;
    for (double& s : share) s = -std::log(1.0 - random.uniform());
    const double sum = share[0] + share[1] + share[2] + share[3];
    Point3 p;
    for (std::size_t v = 0; v < 4; ++v) p = p + (share[v] / sum) * view.sites[vertices[v]];
    return p;
}

double triangle(double value, double low, double high, std::size_t count, std::size_t bin) {
    const double width = (high - low) / static_cast<double>(count);
    const double first = low + 0.5 * width;
    const double last = high - 0.5 * width;
    const double within = value < first ? first : value > last ? last : value;
    const double centre = low + (static_cast<double>(bin) + 0.5) * width;
    return std::max(0.0, 1.0 - std::abs(within - centre) / width);
}

std::vector<std::uint8_t> levelsOf(const std::vector<double>& sums) {
    double whole = 0.0;
    for (const double s : sums) whole += s;
    std::vector<std::uint8_t> bytes;
    for (const double s : sums) {
        // Rounded to 255 steps of the root first, then to 15 steps up to the root of a half.
        const double root = std::floor(255.0 * std::sqrt(s / whole) + 0.5) / 255.0;
        bytes.push_back(
            static_cast<std::uint8_t>(std::min(15.0, std::floor(15.0 * std::sqrt(2.0) * root + 0.5))));
    }
    return bytes;
}

std::array<double, 4> barycentric(const InteriorView& view, std::size_t t, const Point3& p) {
    const TetrahedronCorners corner = cornersOf(view.sites, view.vertices[t]);
    const double whole = sixfoldVolume(corner);
    std::array<double, 4> result;
    for (std::size_t i = 0; i < 4; ++i) {
        TetrahedronCorners replaced = corner;
        replaced[i] = p;
        result[i] = sixfoldVolume(replaced) / whole;
    }
    return result;
}

}  // namespace shapedb::testing_support
