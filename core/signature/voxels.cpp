// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/signature/voxels.h"

#include <algorithm>
#include <cmath>

#include "core/geometry/box.h"

namespace shapedb {

namespace {

constexpr double kBorder = 1e-9;  // so that a centre on a common facet belongs to at least one tetrahedron

struct Range {
    std::ptrdiff_t first, last;
};

// The voxels whose centres may lie between the least and the greatest of four coordinates.
Range centresWithin(double a, double b, double c, double d, double low, double side, std::ptrdiff_t count) {
    const double least = (std::min({a, b, c, d}) - low) / side - 0.5;
    const double greatest = (std::max({a, b, c, d}) - low) / side - 0.5;
    return {std::max<std::ptrdiff_t>(0, static_cast<std::ptrdiff_t>(std::ceil(least))),
            std::min(count - 1, static_cast<std::ptrdiff_t>(std::floor(greatest)))};
}

}  // namespace

Voxels::Voxels(const InteriorView& view) {
    Box box;
    for (const auto& tetrahedron : view.vertices) {
        for (const std::uint32_t v : tetrahedron) box.add(view.sites[v]);
    }
    low_ = box.low;
    const Point3 extent = box.extent();
    side_ = std::max({extent.x, extent.y, extent.z}) / static_cast<double>(kLongestSide);
    // One more for what lies on the far end.
    const auto cells = [this](double length) { return static_cast<std::ptrdiff_t>(length / side_) + 1; };
    count_ = {cells(extent.x), cells(extent.y), cells(extent.z)};
    inside_.assign(static_cast<std::size_t>(count_[0] * count_[1] * count_[2]), 0);
    for (const auto& vertices : view.vertices) fill(cornersOf(view.sites, vertices));
}

void Voxels::fill(const TetrahedronCorners& corners) {
    const auto& [a, b, c, d] = corners;
    const Range x = centresWithin(a.x, b.x, c.x, d.x, low_.x, side_, count_[0]);
    const Range y = centresWithin(a.y, b.y, c.y, d.y, low_.y, side_, count_[1]);
    const Range z = centresWithin(a.z, b.z, c.z, d.z, low_.z, side_, count_[2]);
    if (x.first > x.last || y.first > y.last || z.first > z.last) return;
    const double six = sixfoldVolume(corners);
    if (six == 0.0) return;
    // Rows of the inverse of (b - a, c - a, d - a): barycentric coordinates are dot products.
    const Point3 toB = (1.0 / six) * cross(c - a, d - a);
    const Point3 toC = (1.0 / six) * cross(d - a, b - a);
    const Point3 toD = (1.0 / six) * cross(b - a, c - a);
    for (std::ptrdiff_t i = x.first; i <= x.last; ++i) {
        for (std::ptrdiff_t j = y.first; j <= y.last; ++j) {
            for (std::ptrdiff_t k = z.first; k <= z.last; ++k) {
                const Point3 centre{(static_cast<double>(i) + 0.5) * side_,
                                    (static_cast<double>(j) + 0.5) * side_,
                                    (static_cast<double>(k) + 0.5) * side_};
                const Point3 p = low_ + centre - a;
                const double u = dot(toB, p);
                const double v = dot(toC, p);
                const double w = dot(toD, p);
                if (std::min({u, v, w, 1.0 - u - v - w}) < -kBorder) continue;
                inside_[static_cast<std::size_t>((i * count_[1] + j) * count_[2] + k)] = 1;
            }
        }
    }
}

bool Voxels::inside(const Point3& p) const {
    const auto cell = [this](double x, double low) {
        return static_cast<std::ptrdiff_t>(std::floor((x - low) / side_));
    };
    const std::ptrdiff_t i = cell(p.x, low_.x);
    const std::ptrdiff_t j = cell(p.y, low_.y);
    const std::ptrdiff_t k = cell(p.z, low_.z);
    if (i < 0 || j < 0 || k < 0 || i >= count_[0] || j >= count_[1] || k >= count_[2]) return false;
    return inside_[static_cast<std::size_t>((i * count_[1] + j) * count_[2] + k)] != 0;
}

double Voxels::shareInside(const Point3& a, const Point3& b) const {
    const int steps = std::max(4, static_cast<int>(distance(a, b) / side_));
    int found = 0;
    for (int s = 0; s < steps; ++s) {
        found += inside(a + ((static_cast<double>(s) + 0.5) / steps) * (b - a)) ? 1 : 0;
    }
    return static_cast<double>(found) / steps;
}

}  // namespace shapedb
