#include "core/segmentation/delaunay.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <limits>
#include <new>
#include <numeric>
#include <string>

#include <tbb/global_control.h>
#include <tbb/task_arena.h>

#include "core/geometry/sanitise.h"
#include "core/segmentation/cavity_inserter.h"
#include "core/segmentation/curve_order.h"
#include "core/segmentation/exact_geometry.h"
#include "core/segmentation/flat_delaunay.h"

namespace shapedb {

namespace {

// A tetrahedron is computed exactly when its volume, as a share of the box spanned by its three
// edges at a corner, leaves fewer than about six correct digits in double precision.
constexpr double kFlatShare = 1e-10;

Point3 circumcentre(const TetrahedronCorners& p) {
    const Point3 a = p[1] - p[0];
    const Point3 b = p[2] - p[0];
    const Point3 c = p[3] - p[0];
    const Point3 bc = cross(b, c);
    const double aa = squaredLength(a);
    const double bb = squaredLength(b);
    const double cc = squaredLength(c);
    const double sixVolumes = dot(a, bc);
    if (!(sixVolumes > kFlatShare * std::sqrt(aa * bb * cc))) return exactCircumcentre(p);
    const Point3 numerator = aa * bc + bb * cross(c, a) + cc * cross(a, b);
    return p[0] + (0.5 / sixVolumes) * numerator;
}

// The rank of each vertex stands for it until the end: sites are compared by rank.
using Corners = std::array<std::uint32_t, 4>;

// The even permutation of the corners that has the lowest first and the next lowest second, as
// positions. So a tetrahedron looks the same whatever made it.
std::array<std::uint32_t, 4> canonicalOrder(const Corners& v) {
    std::uint32_t first = 0;
    for (std::uint32_t i = 1; i < 4; ++i) {
        if (v[i] < v[first]) first = i;
    }
    // The others in an order that keeps the sense, then turned.
    static constexpr std::array<std::array<std::uint32_t, 3>, 4> kOthers = {
        {{1, 2, 3}, {0, 3, 2}, {0, 1, 3}, {0, 2, 1}}};
    const auto& others = kOthers[first];
    std::uint32_t turn = 0;
    for (std::uint32_t i = 1; i < 3; ++i) {
        if (v[others[i]] < v[others[turn]]) turn = i;
    }
    return {first, others[turn], others[(turn + 1) % 3], others[(turn + 2) % 3]};
}

bool isFinite(const Corners& v) {
    return v[0] < kInfinite && v[1] < kInfinite && v[2] < kInfinite && v[3] < kInfinite;
}

Corners permuted(const Corners& v, const std::array<std::uint32_t, 4>& order) {
    return {v[order[0]], v[order[1]], v[order[2]], v[order[3]]};
}

// The finite cells by their corners, lowest first; the corners in canonical order. The places of
// cells in the store, which depend on the threads, leave no trace.
std::vector<std::uint32_t> sortedCells(const CellStore& cells, std::size_t siteCount) {
    std::vector<std::uint32_t> begin(siteCount + 1, 0);
    const auto lowest = [](const Corners& v) { return std::min(std::min(v[0], v[1]), std::min(v[2], v[3])); };
    for (std::uint32_t c = 0; c < cells.used(); ++c) {
        if (isFinite(cells[c].vertices)) ++begin[lowest(cells[c].vertices) + 1];
    }
    std::partial_sum(begin.begin(), begin.end(), begin.begin());
    std::vector<std::uint32_t> sorted(begin.back());
    std::vector<std::uint32_t> next(begin.begin(), begin.end() - 1);
    for (std::uint32_t c = 0; c < cells.used(); ++c) {
        if (isFinite(cells[c].vertices)) sorted[next[lowest(cells[c].vertices)]++] = c;
    }
    std::vector<std::pair<Corners, std::uint32_t>> group;
    for (std::size_t v = 0; v < siteCount; ++v) {
        group.clear();
        for (std::uint32_t i = begin[v]; i < begin[v + 1]; ++i) {
            const Corners& corners = cells[sorted[i]].vertices;
            group.emplace_back(permuted(corners, canonicalOrder(corners)), sorted[i]);
        }
        std::sort(group.begin(), group.end());
        for (std::size_t i = 0; i < group.size(); ++i) sorted[begin[v] + i] = group[i].second;
    }
    return sorted;
}

// `order`: the point of each site.
Tetrahedra flatten(const CellStore& cells, const std::vector<std::uint32_t>& order) {
    const std::vector<std::uint32_t> sorted = sortedCells(cells, order.size());
    std::vector<std::uint32_t> place(cells.used(), kNoTetrahedron);
    for (std::uint32_t t = 0; t < sorted.size(); ++t) place[sorted[t]] = t;
    Tetrahedra flat;
    flat.vertices.reserve(sorted.size());
    flat.neighbours.reserve(sorted.size());
    for (const std::uint32_t c : sorted) {
        const Cell& cell = cells[c];
        const auto positions = canonicalOrder(cell.vertices);
        std::array<std::uint32_t, 4> vertices;
        std::array<std::uint32_t, 4> neighbours;
        for (std::size_t i = 0; i < 4; ++i) {
            vertices[i] = order[cell.vertices[positions[i]]];
            neighbours[i] = place[cell.neighbours[positions[i]]];
        }
        flat.vertices.push_back(vertices);
        flat.neighbours.push_back(neighbours);
    }
    return flat;
}

void measureBalls(const PointCloud& points, Tetrahedra& flat) {
    flat.circumcentres.reserve(flat.size());
    flat.circumradii.reserve(flat.size());
    for (const auto& v : flat.vertices) {
        const TetrahedronCorners corners = {points[v[0]], points[v[1]], points[v[2]], points[v[3]]};
        const Point3 centre = circumcentre(corners);
        flat.circumcentres.push_back(centre);
        flat.circumradii.push_back(distance(centre, corners[0]));
    }
}

Result<void> checkDistinct(const PointCloud& points) {
    if (mergeDuplicates(points).points.size() == points.size()) return {};
    return fail(ErrorCode::kInternal, "the points to triangulate are not distinct");
}

// As many threads as the caller's arena, and whatever limits it, allow.
int threadsOfArena() {
    const auto allowed = tbb::global_control::active_value(tbb::global_control::max_allowed_parallelism);
    return std::min(tbb::this_task_arena::max_concurrency(), static_cast<int>(allowed));
}

Result<Tetrahedra> triangulateOrThrow(const PointCloud& points, const RunContext& context) {
    const std::vector<std::uint32_t> order = curveOrder(points);
    Tetrahedra flat;
    {
        CellStore cells;
        std::vector<Site> sites(points.size());
        for (std::size_t i = 0; i < sites.size(); ++i) {
            const Point3& p = points[order[i]];
            sites[i] = {p.x, p.y, p.z};
        }
        if (auto done = insertAll(sites, cells, threadsOfArena(), context); !done) {
            if (done.error().code == ErrorCode::kCollinear || done.error().code == ErrorCode::kCoplanar) {
                if (auto distinct = checkDistinct(points); !distinct) return fail(distinct.error());
            }
            return fail(done.error());
        }
        flat = flatten(cells, order);
    }
    measureBalls(points, flat);
    return flat;
}

}  // namespace

Result<Tetrahedra> triangulate(const PointCloud& points, const RunContext& context) {
    if (points.size() < 4) return fail(ErrorCode::kTooFewPoints, "fewer than 4 distinct points");
    try {
        return triangulateOrThrow(points, context);
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::kOutOfMemory, "not enough memory for the Delaunay triangulation of " +
                                                 std::to_string(points.size()) + " points");
    } catch (const std::exception& e) {
        return fail(ErrorCode::kInternal, std::string("Delaunay triangulation: ") + e.what());
    }
}

}  // namespace shapedb
