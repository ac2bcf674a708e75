// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/delaunay/delaunay.h"

#include <algorithm>
#include <cmath>
#include <exception>
#include <limits>
#include <new>
#include <numeric>
#include <string>

#include "core/base/parallel.h"
#include "core/base/processor.h"
#include "core/base/return_if_error.h"
#include "core/delaunay/bowyer_watson.h"
#include "core/delaunay/flat_delaunay.h"
#include "core/delaunay/hilbert_order.h"
#include "core/geometry/merge_duplicates.h"
#include "core/geometry/tetrahedron.h"
#include "core/geometry/vec3x2.h"

namespace shapedb {

namespace {

// Below this ratio of six volumes to the product of the edges at the first corner, double precision leaves
// fewer than about six correct digits of the circumcentre, and it is computed exactly.
constexpr double kFlatRatio = 1e-10;

// The circumcentres of two tetrahedra, side by side, relative to their first corners; a, b and c are the
// other corners, likewise. Bit 0 or 1 of the result: that tetrahedron is too flat for double precision.
unsigned circumcentres(const Vec3x2& a, const Vec3x2& b, const Vec3x2& c, Vec3x2& fromFirst) {
    const Vec3x2 bc = cross(b, c);
    const Double2 aa = squaredLength(a);
    const Double2 bb = squaredLength(b);
    const Double2 cc = squaredLength(c);
    const Double2 sixVolumes = dot(a, bc);
    fromFirst = (Double2(0.5) / sixVolumes) * (aa * bc + bb * cross(c, a) + cc * cross(a, b));
    const unsigned solid = less(0.0, sixVolumes) &
                           less(Double2(kFlatRatio * kFlatRatio) * (aa * bb * cc), sixVolumes * sixVolumes);
    return ~solid & 3u;
}

using Corners = std::array<std::uint32_t, 4>;

// Applies the even permutation that puts the lowest corner first and the lowest of the others second to
// corners and neighbours, so that a tetrahedron looks the same however it came about. An even number of swaps
// keeps the orientation. Branch-free as far as possible, because which corner is lowest is random.
void makeCanonical(Cell& cell) {
    Corners& v = cell.vertices;
    Corners& n = cell.neighbours;
    const auto swapPlaces = [&](std::uint32_t i, std::uint32_t j) {
        std::swap(v[i], v[j]);
        std::swap(n[i], n[j]);
    };
    const std::uint32_t low01 = v[1] < v[0] ? 1 : 0;
    const std::uint32_t low23 = v[3] < v[2] ? 3 : 2;
    const std::uint32_t first = v[low23] < v[low01] ? low23 : low01;
    // The lowest to the front by a double swap: (0 1)(2 3), (0 2)(1 3) or (0 3)(1 2).
    const Corners w = v;
    const Corners m = n;
    for (std::uint32_t i = 0; i < 4; ++i) {
        v[i] = w[i ^ first];
        n[i] = m[i ^ first];
    }
    if (v[2] < v[1] && v[2] < v[3]) {
        swapPlaces(1, 2);
        swapPlaces(2, 3);
    } else if (v[3] < v[1]) {
        swapPlaces(1, 3);
        swapPlaces(2, 3);
    }
}

constexpr std::size_t kCopiedPerBlock = 8192;  // points, cells or tetrahedra that a thread handles at a time
// Parts of the store with fewer cells are not worth counters of their own.
constexpr std::size_t kMinPart = std::size_t{1} << 18;

// A counting sort by lowest vertex, over parts of the store in parallel. First `at` counts the finite cells
// of a part that have a vertex as their lowest; after toPlaces it is where the next of them goes in the
// sorted list.
class LowestVertices {
  public:
    LowestVertices(std::size_t parts, std::size_t siteCount)
        : siteCount_(siteCount), counts_(parts * siteCount) {}

    std::uint32_t& at(std::size_t part, std::uint32_t vertex) { return counts_[part * siteCount_ + vertex]; }
    void clear(std::size_t part) {
        const auto begin = counts_.begin() + static_cast<std::ptrdiff_t>(part * siteCount_);
        std::fill(begin, begin + static_cast<std::ptrdiff_t>(siteCount_), 0);
    }
    // Returns where the cells of each vertex begin and, as the last entry, their total number.
    LargeVector<std::uint32_t> toPlaces() {
        LargeVector<std::uint32_t> begin(siteCount_ + 1);
        std::uint32_t next = 0;
        for (std::size_t v = 0; v < siteCount_; ++v) {
            begin[v] = next;
            for (std::size_t c = v; c < counts_.size(); c += siteCount_) {
                next += counts_[c];
                counts_[c] = next - counts_[c];
            }
        }
        begin[siteCount_] = next;
        return begin;
    }

  private:
    std::size_t siteCount_;
    LargeVector<std::uint32_t> counts_;
};

// Makes the finite cells canonical and returns them sorted by their corners: where they lie in the store,
// which depends on the threads, leaves no trace. Post: place[c] is the position of cell c in that list,
// kNoTetrahedron for cells at infinity and free ones; no cell has marks.
Result<LargeVector<std::uint32_t>> sortedCells(CellStore& cells, std::size_t siteCount,
                                               LargeVector<std::uint32_t>& place, const RunContext& context) {
    const std::size_t parts = std::clamp<std::size_t>(cells.used() / kMinPart, 1, threadsOfArena());
    LowestVertices lowest(parts, siteCount);
    auto done = parallelForParts(cells.used(), parts, context,
                                 [&](std::size_t part, std::size_t from, std::size_t to) {
                                     // The memory is uninitialised, and cleared here by all threads at once.
                                     lowest.clear(part);
                                     for (std::size_t c = from; c < to; ++c) {
                                         Cell& cell = cells[static_cast<std::uint32_t>(c)];
                                         place[c] = kNoTetrahedron;
                                         cell.vertices[0] = cell.firstVertex();  // not finite for a free cell
                                         if (!isFinite(cell.vertices)) continue;
                                         makeCanonical(cell);
                                         ++lowest.at(part, cell.vertices[0]);
                                     }
                                 });
    RETURN_IF_ERROR(done);
    const LargeVector<std::uint32_t> begin = lowest.toPlaces();
    LargeVector<std::uint32_t> sorted(begin.back());
    // The same parts as above: each fills the places that it counted.
    done = parallelForParts(cells.used(), parts, context,
                            [&](std::size_t part, std::size_t from, std::size_t to) {
                                for (std::size_t c = from; c < to; ++c) {
                                    const auto cell = static_cast<std::uint32_t>(c);
                                    if (isFinite(cells[cell].vertices))
                                        sorted[lowest.at(part, cells[cell].vertices[0])++] = cell;
                                }
                            });
    RETURN_IF_ERROR(done);
    // Within the cells of one lowest vertex: the second and third corner decide, since only one cell lies on
    // either side of a facet.
    done = parallelFor(siteCount, kCopiedPerBlock, context, [&](std::size_t from, std::size_t to) {
        std::vector<std::pair<std::uint64_t, std::uint32_t>> group;
        for (std::size_t v = from; v < to; ++v) {
            group.clear();
            for (std::uint32_t i = begin[v]; i < begin[v + 1]; ++i) {
                if (i + kPrefetchFarDistance < begin[to]) prefetch(&cells[sorted[i + kPrefetchFarDistance]]);
                const Corners& corners = cells[sorted[i]].vertices;
                group.emplace_back(std::uint64_t{corners[1]} << 32 | corners[2], sorted[i]);
            }
            std::sort(group.begin(), group.end());
            for (std::size_t i = 0; i < group.size(); ++i) {
                sorted[begin[v] + i] = group[i].second;
                place[group[i].second] = begin[v] + static_cast<std::uint32_t>(i);
            }
        }
    });
    RETURN_IF_ERROR(done);
    return sorted;
}

// Copies the finite cells into their final order, balls apart. `order`: the point of each site.
// Pre: nothing more is inserted; the memory of the cached balls is reused.
Result<Tetrahedra> flatten(CellStore& cells, const std::vector<std::uint32_t>& order,
                           const RunContext& context) {
    LargeVector<std::uint32_t> place(cells.used());
    const auto sorted = sortedCells(cells, order.size(), place, context);
    RETURN_IF_ERROR(sorted);
    const LargeVector<std::uint32_t>& cellOf = *sorted;
    Tetrahedra flat;
    {
        // 32 bytes a tetrahedron, like the balls whose pages these take over.
        PageRecycler balls = cells.recycleBalls();
        flat.vertices = balls.makeVector<Corners>(cellOf.size());
        flat.neighbours = balls.makeVector<Corners>(cellOf.size());
    }
    auto done = parallelFor(cellOf.size(), kCopiedPerBlock, context, [&](std::size_t from, std::size_t to) {
        for (std::size_t t = from; t < to; ++t) {
            if (t + kPrefetchFarDistance < to) {
                prefetch(&cells[cellOf[t + kPrefetchFarDistance]]);
                for (const std::uint32_t next : cells[cellOf[t + kPrefetchDistance]].neighbours)
                    prefetch(&place[next]);
            }
            const Cell& cell = cells[cellOf[t]];
            for (std::size_t i = 0; i < 4; ++i) {
                flat.vertices[t][i] = order[cell.vertices[i]];
                flat.neighbours[t][i] = place[cell.neighbours[i]];
            }
        }
    });
    RETURN_IF_ERROR(done);
    return flat;
}

// The balls of tetrahedra t and u, which may be the same.
void computeTwoBalls(const PointCloud& points, Tetrahedra& flat, std::size_t t, std::size_t u) {
    const Corners& v = flat.vertices[t];
    const Corners& w = flat.vertices[u];
    const Vec3x2 first(points[v[0]], points[w[0]]);
    const auto offsetTo = [&](std::size_t i) { return Vec3x2(points[v[i]], points[w[i]]) - first; };
    Vec3x2 fromFirst;
    const unsigned tooFlat = circumcentres(offsetTo(1), offsetTo(2), offsetTo(3), fromFirst);
    Vec3x2 centre = first + fromFirst;
    if (tooFlat != 0) {
        centre = Vec3x2((tooFlat & 1u) != 0 ? exactCircumcentre(cornersOf(points, v)) : centre.low(),
                        (tooFlat & 2u) != 0 ? exactCircumcentre(cornersOf(points, w)) : centre.high());
    }
    // From the centre as rounded, to be consistent with it.
    const Double2 radius = length(centre - first);
    flat.circumcentres[t] = centre.low();
    flat.circumcentres[u] = centre.high();
    flat.circumradii[t] = radius.low();
    flat.circumradii[u] = radius.high();
}

Result<void> computeBalls(const PointCloud& points, Tetrahedra& flat, PageRecycler pages,
                          const RunContext& context) {
    // 32 bytes a tetrahedron, like the cells.
    flat.circumcentres = pages.makeVector<Point3>(flat.size());
    flat.circumradii = pages.makeVector<double>(flat.size());
    return parallelFor(flat.size(), kCopiedPerBlock, context, [&](std::size_t from, std::size_t to) {
        for (std::size_t t = from; t < to; t += 2) computeTwoBalls(points, flat, t, std::min(t + 1, to - 1));
    });
}

Result<void> checkDistinct(const PointCloud& points) {
    if (mergeDuplicates(points).points.size() == points.size()) return {};
    return fail(duplicatePointsError());
}

// Sites are numbered by `order`, so that they lie in Hilbert order in memory.
Result<Tetrahedra> triangulateInOrder(const PointCloud& points, const std::vector<std::uint32_t>& order,
                                      const RunContext& context) {
    CellStore cells;
    LargeVector<Site> sites(points.size());
    auto placed = parallelFor(sites.size(), kCopiedPerBlock, context, [&](std::size_t from, std::size_t to) {
        for (std::size_t i = from; i < to; ++i) {
            const Point3& p = points[order[i]];
            sites[i] = {p.x, p.y, p.z};
        }
    });
    RETURN_IF_ERROR(placed);
    if (auto done = buildTriangulation(sites, cells, threadsOfArena(), context); !done) {
        // A flat cloud is turned down before insertion, which is what finds duplicates.
        if (done.error().code == ErrorCode::kCollinear || done.error().code == ErrorCode::kCoplanar) {
            RETURN_IF_ERROR(checkDistinct(points));
        }
        return fail(done.error());
    }
    LargeVector<Site>().swap(sites);  // unlike clear(), frees the memory
    auto flat = flatten(cells, order, context);
    RETURN_IF_ERROR(flat);
    RETURN_IF_ERROR(computeBalls(points, *flat, cells.recycleCells(), context));
    return flat;
}

// `makeOrder` returns the order in which the points are numbered as sites.
template <typename MakeOrder>
Result<Tetrahedra> triangulateWith(const PointCloud& points, const RunContext& context,
                                   const MakeOrder& makeOrder) {
    if (points.size() < 4) return fail(ErrorCode::kTooFewPoints, "fewer than 4 distinct points");
    try {
        return triangulateInOrder(points, makeOrder(), context);
    } catch (const std::bad_alloc&) {
        return fail(ErrorCode::kOutOfMemory, "not enough memory for the Delaunay triangulation of " +
                                                 std::to_string(points.size()) + " points");
    } catch (const std::exception& e) {
        return fail(ErrorCode::kInternal, std::string("Delaunay triangulation: ") + e.what());
    }
}

}  // namespace

Result<Tetrahedra> triangulate(const PointCloud& points, const RunContext& context) {
    return triangulateWith(points, context, [&] { return hilbertOrder(points); });
}

Result<Tetrahedra> triangulate(const HilbertSortedCloud& sorted, const RunContext& context) {
    return triangulateWith(sorted.points(), context, [&] {
        std::vector<std::uint32_t> order(sorted.points().size());
        std::iota(order.begin(), order.end(), 0);
        return order;
    });
}

}  // namespace shapedb
