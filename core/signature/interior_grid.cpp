// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/signature/interior_grid.h"

#include <algorithm>
#include <cmath>

#include "core/base/random.h"
#include "core/delaunay/delaunay.h"
#include "core/geometry/box.h"
#include "core/geometry/tetrahedron.h"

namespace shapedb {

namespace {

constexpr double kSideGrowth = 1.05;  // of voxels, until there are few enough
constexpr std::uint64_t kSeed = 1969;
constexpr std::int32_t kGapSteps = 256;  // positions between two centres are counted in such steps

double along(const Point3& p, std::size_t axis) { return axis == 0 ? p.x : axis == 1 ? p.y : p.z; }

// Uniform over a tetrahedron: the gaps between sorted numbers are barycentric coordinates.
Point3 pointIn(const TetrahedronCorners& corners, Random& random) {
    std::array<double, 3> cut{random.uniform(), random.uniform(), random.uniform()};
    std::sort(cut.begin(), cut.end());
    return cut[0] * corners[0] + (cut[1] - cut[0]) * corners[1] + (cut[2] - cut[1]) * corners[2] +
           (1.0 - cut[2]) * corners[3];
}

// Twice the area of (a, b, p), the same number but for its sign when a and b are exchanged, so that a line
// through the common edge of two facets crosses exactly one of them.
bool leftOf(std::uint32_t ia, std::uint32_t ib, const std::array<double, 2>& a,
            const std::array<double, 2>& b, double u, double v) {
    const bool swap = ia > ib;
    const auto& p = swap ? b : a;
    const auto& q = swap ? a : b;
    const bool left = (q[0] - p[0]) * (v - p[1]) - (q[1] - p[1]) * (u - p[0]) >= 0.0;
    return left != swap;
}

}  // namespace

struct InteriorGrid::Crossings {
    std::vector<std::int8_t> entered;                  // along the last axis: in minus out
    std::array<std::vector<std::int16_t>, 3> outside;  // steps between leaving and entering again
};

InteriorGrid::InteriorGrid(const InteriorView& view, double side) {
    layOut(view, side);
    Crossings crossings;
    crossings.entered.assign(links_.size(), 0);
    for (auto& steps : crossings.outside) steps.assign(links_.size(), 0);
    crossSurface(view, crossings);
    fill(crossings);
    sampleMatter(view);
    link(crossings);
    measureClearance();
}

// One voxel of margin on all sides.
void InteriorGrid::layOut(const InteriorView& view, double side) {
    Box box;
    for (const auto& tetrahedron : view.vertices) {
        for (const std::uint32_t v : tetrahedron) box.add(view.sites[v]);
    }
    const Point3 extent = box.extent();
    side_ = side;
    const auto countAlong = [this](double length) { return std::ceil(length / side_) + 3.0; };
    const auto voxels = [&] { return countAlong(extent.x) * countAlong(extent.y) * countAlong(extent.z); };
    while (voxels() > static_cast<double>(kMostVoxels)) side_ *= kSideGrowth;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        count_[axis] = static_cast<std::int32_t>(countAlong(along(extent, axis)));
    }
    stride_ = {static_cast<std::uint32_t>(count_[1] * count_[2]), static_cast<std::uint32_t>(count_[2]), 1};
    low_ = box.low - 0.5 * side_ * Point3{1.0, 1.0, 1.0};
    links_.assign(static_cast<std::size_t>(count_[0]) * stride_[0], 0);
}

void InteriorGrid::crossSurface(const InteriorView& view, Crossings& crossings) const {
    double handedness = 0.0;  // the frame may mirror the tetrahedra
    for (const auto& vertices : view.vertices) handedness += sixfoldVolume(cornersOf(view.sites, vertices));
    for (std::size_t t = 0; t < view.vertices.size(); ++t) {
        for (std::size_t f = 0; f < 4; ++f) {
            if (view.neighbours[t][f] != kNoTetrahedron) continue;
            const auto& v = view.vertices[t];
            std::array<std::uint32_t, 3> facet{v[(f + 1) % 4], v[(f + 2) % 4], v[(f + 3) % 4]};
            // Counter-clockwise from outside, from the orientation alone: a flat tetrahedron has one too.
            if ((f % 2 == 1) != (handedness < 0.0)) std::swap(facet[1], facet[2]);
            for (std::size_t axis = 0; axis < 3; ++axis) crossFacet(view, facet, axis, crossings);
        }
    }
}

// Lines through the voxels' centres along one axis that cross a facet.
void InteriorGrid::crossFacet(const InteriorView& view, const std::array<std::uint32_t, 3>& facet,
                              std::size_t axis, Crossings& crossings) const {
    const std::size_t across = (axis + 1) % 3;
    const std::size_t up = (axis + 2) % 3;
    std::array<std::array<double, 2>, 3> flat;
    std::array<double, 3> height;
    for (std::size_t i = 0; i < 3; ++i) {
        const Point3 q = inVoxels(view.sites[facet[i]]);
        flat[i] = {along(q, across), along(q, up)};
        height[i] = along(q, axis);
    }
    const auto [uLow, uHigh] = std::minmax({flat[0][0], flat[1][0], flat[2][0]});
    const auto [vLow, vHigh] = std::minmax({flat[0][1], flat[1][1], flat[2][1]});
    const auto [least, most] = std::minmax({height[0], height[1], height[2]});
    const std::array<double, 2> b{flat[1][0] - flat[0][0], flat[1][1] - flat[0][1]};
    const std::array<double, 2> c{flat[2][0] - flat[0][0], flat[2][1] - flat[0][1]};
    const double area = b[0] * c[1] - b[1] * c[0];
    if (area == 0.0) return;
    for (double u = std::ceil(uLow); u <= uHigh; u += 1.0) {
        for (double v = std::ceil(vLow); v <= vHigh; v += 1.0) {
            const bool left = leftOf(facet[0], facet[1], flat[0], flat[1], u, v);
            if (left != leftOf(facet[1], facet[2], flat[1], flat[2], u, v)) continue;
            if (left != leftOf(facet[2], facet[0], flat[2], flat[0], u, v)) continue;
            const double du = u - flat[0][0];
            const double dv = v - flat[0][1];
            const double h = height[0] + ((du * c[1] - dv * c[0]) * (height[1] - height[0]) +
                                          (b[0] * dv - b[1] * du) * (height[2] - height[0])) /
                                             area;
            const double place = std::clamp(h, least, most);
            const double before = std::floor(place);
            // Seen from beyond, the facet turns its outer side to the viewer: the line leaves.
            const int way = left ? -1 : 1;
            const std::size_t at = static_cast<std::size_t>(before) * stride_[axis] +
                                   static_cast<std::size_t>(u) * stride_[across] +
                                   static_cast<std::size_t>(v) * stride_[up];
            if (axis == 2) crossings.entered[at] = static_cast<std::int8_t>(crossings.entered[at] + way);
            const auto steps = static_cast<std::int32_t>((place - before) * kGapSteps);
            crossings.outside[axis][at] =
                static_cast<std::int16_t>(crossings.outside[axis][at] + way * steps);
        }
    }
}

void InteriorGrid::fill(const Crossings& crossings) {
    const auto line = static_cast<std::size_t>(count_[2]);
    for (std::size_t first = 0; first < links_.size(); first += line) {
        int depth = 0;
        for (std::size_t k = first; k < first + line; ++k) {
            if (depth > 0) links_[k] = kInside;
            depth += crossings.entered[k];
        }
    }
}

// Stratified by volume along the order of the tetrahedra.
void InteriorGrid::sampleMatter(const InteriorView& view) {
    Random random(kSeed);
    matter_.reserve(kMatter);
    PointCloud points;
    points.reserve(kMatter);
    volumePerPoint_ = view.volume / static_cast<double>(kMatter);
    double passed = 0.0;
    std::size_t t = 0;
    for (std::size_t i = 0; i < kMatter; ++i) {
        const double target = (static_cast<double>(i) + random.uniform()) * volumePerPoint_;
        while (t + 1 < view.volumes.size() && passed + view.volumes[t] < target) passed += view.volumes[t++];
        points.push_back(pointIn(cornersOf(view.sites, view.vertices[t]), random));
        const std::uint32_t voxel = voxelAt(points.back());
        matter_.push_back({static_cast<std::uint32_t>(t), voxel});
        if (voxel == kNoVoxel || inside(voxel)) continue;
        if (view.radii[t] < kThin * side_ || insideBeside(voxel, points.back()) == kNoVoxel) {
            forced_.push_back(voxel);
        }
    }
    std::sort(forced_.begin(), forced_.end());
    forced_.erase(std::unique(forced_.begin(), forced_.end()), forced_.end());
    forcedMatter_.assign(forced_.size(), 0);
    for (const std::uint32_t voxel : forced_) links_[voxel] = kInside | kForced;
    for (std::size_t i = 0; i < kMatter; ++i) {
        std::uint32_t& voxel = matter_[i].voxel;
        if (voxel == kNoVoxel) continue;
        if (!inside(voxel)) voxel = insideBeside(voxel, points[i]);
        if (voxel == kNoVoxel || (links_[voxel] & kForced) == 0) continue;
        ++forcedMatter_[static_cast<std::size_t>(std::lower_bound(forced_.begin(), forced_.end(), voxel) -
                                                 forced_.begin())];
    }
}

// Of the six voxels beside this one, the nearest to p that is inside.
std::uint32_t InteriorGrid::insideBeside(std::uint32_t voxel, const Point3& p) const {
    const auto place = placeOf(voxel);
    std::uint32_t best = kNoVoxel;
    double least = 0.0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        for (const int step : {-1, 1}) {
            const std::int32_t to = place[axis] + step;
            if (to < 0 || to >= count_[axis]) continue;
            const std::uint32_t other = step < 0 ? voxel - stride_[axis] : voxel + stride_[axis];
            if (!inside(other)) continue;
            const double d = distance(centreOf(other), p);
            if (best != kNoVoxel && d >= least) continue;
            best = other;
            least = d;
        }
    }
    return best;
}

void InteriorGrid::link(const Crossings& crossings) {
    const auto widest = static_cast<int>(kWidestGap * kGapSteps);
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto& outside = crossings.outside[axis];
        // The margin is outside, so the next voxel of one inside exists.
        for (std::uint32_t v = 0; v + stride_[axis] < links_.size(); ++v) {
            const std::uint32_t next = v + stride_[axis];
            if (!inside(v) || !inside(next)) continue;
            // Where a voxel is forced, its centre is not inside, and gaps have no meaning.
            const bool forced = ((links_[v] | links_[next]) & kForced) != 0;
            if (forced || outside[v] <= widest) links_[v] |= static_cast<std::uint8_t>(1U << axis);
        }
    }
}

// Two sweeps over the 13 neighbours before and after give exact distances in steps that may be diagonal
// (Rosenfeld and Pfaltz 1966).
void InteriorGrid::measureClearance() {
    clearance_.assign(links_.size(), 0);
    std::array<std::uint32_t, 13> before{};
    std::size_t n = 0;
    for (int code = 0; code < 13; ++code) {
        const std::array<int, 3> way{code / 9 - 1, code / 3 % 3 - 1, code % 3 - 1};
        std::uint32_t back = 0;
        for (std::size_t axis = 0; axis < 3; ++axis)
            back -= static_cast<std::uint32_t>(way[axis]) * stride_[axis];
        before[n++] = back;
    }
    // All voxels around one that is inside exist, because of the margin.
    for (std::uint32_t v = 0; v < links_.size(); ++v) {
        if (!inside(v)) continue;
        bool open = true;
        for (std::size_t axis = 0; axis < 3; ++axis) {
            open = open && linked(v, axis) && linked(v - stride_[axis], axis);
        }
        int least = open ? 254 : 0;
        for (const std::uint32_t step : before) least = std::min<int>(least, clearance_[v - step]);
        clearance_[v] = static_cast<std::uint8_t>(least + 1);
    }
    for (std::size_t i = links_.size(); i-- > 0;) {
        if (clearance_[i] <= 1) continue;
        int least = clearance_[i] - 1;
        for (const std::uint32_t step : before) least = std::min<int>(least, clearance_[i + step]);
        clearance_[i] = static_cast<std::uint8_t>(least + 1);
    }
}

InteriorGrid::Place InteriorGrid::placeOf(std::uint32_t voxel) const {
    const std::uint32_t rest = voxel % stride_[0];
    return {static_cast<std::int32_t>(voxel / stride_[0]), static_cast<std::int32_t>(rest / stride_[1]),
            static_cast<std::int32_t>(rest % stride_[1])};
}

Point3 InteriorGrid::centreOf(std::uint32_t voxel) const {
    const auto place = placeOf(voxel);
    return low_ + side_ * Point3{static_cast<double>(place[0]), static_cast<double>(place[1]),
                                 static_cast<double>(place[2])};
}

std::uint32_t InteriorGrid::voxelAt(const Point3& p) const {
    const Point3 q = inVoxels(p);
    std::uint32_t voxel = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        const auto i = static_cast<std::int32_t>(std::floor(along(q, axis) + 0.5));
        if (i < 0 || i >= count_[axis]) return kNoVoxel;
        voxel += static_cast<std::uint32_t>(i) * stride_[axis];
    }
    return voxel;
}

double InteriorGrid::volumeOf(std::uint32_t voxel) const {
    if ((links_[voxel] & kForced) == 0) return side_ * side_ * side_;
    const auto at = std::lower_bound(forced_.begin(), forced_.end(), voxel) - forced_.begin();
    return std::min(1.0 * forcedMatter_[static_cast<std::size_t>(at)] * volumePerPoint_,
                    side_ * side_ * side_);
}

// Whether links lead to a voxel at most one step away along each axis, in any order of the axes.
bool InteriorGrid::joined(std::uint32_t voxel, const Place& way) const {
    if (way[0] == 0 && way[1] == 0 && way[2] == 0) return true;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        if (way[axis] == 0) continue;
        const std::uint32_t next = way[axis] > 0 ? voxel + stride_[axis] : voxel - stride_[axis];
        if (!linked(way[axis] > 0 ? voxel : next, axis)) continue;
        Place rest = way;
        rest[axis] = 0;
        if (joined(next, rest)) return true;
    }
    return false;
}

// Steps of one voxel along the longest axis; far from the surface as many at once as cannot reach it.
bool InteriorGrid::sees(const Point3& a, const Point3& b) const {
    const Point3 from = inVoxels(a) + Point3{0.5, 0.5, 0.5};
    const Point3 way = inVoxels(b) + Point3{0.5, 0.5, 0.5} - from;
    const double steps = std::max({std::abs(way.x), std::abs(way.y), std::abs(way.z)});
    if (!(steps > 0.0)) return true;
    const Point3 step = (1.0 / steps) * way;
    const auto placeAt = [&](double done) {
        return Place{static_cast<std::int32_t>(from.x + done * step.x),
                     static_cast<std::int32_t>(from.y + done * step.y),
                     static_cast<std::int32_t>(from.z + done * step.z)};
    };
    Place place = placeAt(0.0);
    std::uint32_t voxel = indexOf(place);
    if (clearance_[voxel] == 0) return false;
    for (double done = 0.0; done < steps;) {
        const int clearance = clearance_[voxel];
        // Cutting to whole voxels may add a step.
        done = std::min(steps, done + std::max(1, clearance - 2));
        const Place next = placeAt(done);
        const std::uint32_t there = indexOf(next);
        if (clearance_[there] == 0) return false;
        // Links of a voxel with a greater clearance are all there.
        const bool look = clearance == 1 || (clearance == 2 && clearance_[there] == 1);
        if (look && !joined(voxel, {next[0] - place[0], next[1] - place[1], next[2] - place[2]}))
            return false;
        place = next;
        voxel = there;
    }
    return true;
}

}  // namespace shapedb
