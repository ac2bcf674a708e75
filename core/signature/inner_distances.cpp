// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/signature/inner_distances.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <tuple>
#include <utility>

#include "core/base/disjoint_sets.h"
#include "core/base/parallel.h"
#include "core/base/return_if_error.h"
#include "core/delaunay/delaunay.h"
#include "core/signature/interior_grid.h"
#include "core/signature/taut_paths.h"

namespace shapedb {

namespace {

constexpr std::int32_t kVoxelsPerSide = 4;  // of a cell

constexpr std::size_t kBlock = 16;  // sources per task

using Place = InteriorGrid::Place;

// The voxels gathered into cells.
struct Cells {
    std::vector<std::uint32_t> ofVoxel;  // kNoCell outside
    std::vector<std::uint32_t> voxels;   // cell by cell
    std::vector<std::uint32_t> begin;    // of each cell's voxels; one more marks the end
    std::vector<Place> cube;             // that holds each cell

    std::size_t size() const { return cube.size(); }
};

std::int32_t cellSide(const InteriorGrid& grid, double side) {
    return std::max(1, static_cast<std::int32_t>(std::lround(side / grid.side())));
}

// Whether a link leads from a voxel to the next along an axis, forwards or backwards.
bool leads(const InteriorGrid& grid, std::uint32_t voxel, std::size_t axis, bool forwards) {
    return grid.linked(forwards ? voxel : voxel - grid.stride(axis), axis);
}

// A cell is what links reach within one cube. The first voxel of the grid is margin.
Cells gatherCells(const InteriorGrid& grid, std::int32_t side) {
    Cells cells;
    cells.ofVoxel.assign(grid.size(), InnerDistances::kNoCell);
    const auto cubeOf = [&](std::uint32_t voxel) {
        Place place = grid.placeOf(voxel);
        for (std::int32_t& p : place) p = (p + side - 1) / side;
        return place;
    };
    for (std::uint32_t seed = 0; seed < grid.size(); ++seed) {
        if (!grid.inside(seed) || cells.ofVoxel[seed] != InnerDistances::kNoCell) continue;
        const auto cell = static_cast<std::uint32_t>(cells.size());
        const Place cube = cubeOf(seed);
        cells.cube.push_back(cube);
        cells.begin.push_back(static_cast<std::uint32_t>(cells.voxels.size()));
        cells.ofVoxel[seed] = cell;
        cells.voxels.push_back(seed);
        for (std::size_t i = cells.begin.back(); i < cells.voxels.size(); ++i) {
            const std::uint32_t voxel = cells.voxels[i];
            for (std::size_t way = 0; way < 6; ++way) {
                const std::size_t axis = way / 2;
                const bool forwards = way % 2 == 1;
                if (!leads(grid, voxel, axis, forwards)) continue;
                const std::uint32_t next = forwards ? voxel + grid.stride(axis) : voxel - grid.stride(axis);
                if (cells.ofVoxel[next] != InnerDistances::kNoCell || cubeOf(next) != cube) continue;
                cells.ofVoxel[next] = cell;
                cells.voxels.push_back(next);
            }
        }
    }
    cells.begin.push_back(static_cast<std::uint32_t>(cells.voxels.size()));
    return cells;
}

// The centroid of each cell, or where that lies outside it, the nearest voxel's centre.
void placeCells(const InteriorGrid& grid, const Cells& cells, InnerDistances& result) {
    for (std::uint32_t c = 0; c < cells.size(); ++c) {
        Point3 sum;
        double volume = 0.0;
        for (std::uint32_t i = cells.begin[c]; i < cells.begin[c + 1]; ++i) {
            const double v = grid.volumeOf(cells.voxels[i]);
            sum = sum + v * grid.centreOf(cells.voxels[i]);
            volume += v;
        }
        // A voxel with so little matter that no point stands for it.
        Point3 centre = volume > 0.0 ? (1.0 / volume) * sum : grid.centreOf(cells.voxels[cells.begin[c]]);
        const std::uint32_t at = grid.voxelAt(centre);
        if (at == InteriorGrid::kNoVoxel || cells.ofVoxel[at] != c) {
            const Point3 centroid = centre;
            double least = InnerDistances::kUnreached;
            for (std::uint32_t i = cells.begin[c]; i < cells.begin[c + 1]; ++i) {
                const Point3 p = grid.centreOf(cells.voxels[i]);
                if (distance(p, centroid) >= least) continue;
                least = distance(p, centroid);
                centre = p;
            }
        }
        result.centres.push_back(centre);
        result.volumes.push_back(volume);
    }
}

using CellPair = std::pair<std::uint32_t, std::uint32_t>;

void keepDistinct(std::vector<CellPair>& pairs) {
    std::sort(pairs.begin(), pairs.end());
    pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
}

std::vector<CellPair> touchingCells(const InteriorGrid& grid, const Cells& cells) {
    std::vector<CellPair> pairs;
    for (std::uint32_t c = 0; c < cells.size(); ++c) {
        const std::size_t first = pairs.size();
        for (std::uint32_t i = cells.begin[c]; i < cells.begin[c + 1]; ++i) {
            const std::uint32_t voxel = cells.voxels[i];
            for (std::size_t axis = 0; axis < 3; ++axis) {
                if (!grid.linked(voxel, axis)) continue;
                const std::uint32_t other = cells.ofVoxel[voxel + grid.stride(axis)];
                if (other == c) continue;
                const CellPair pair = std::minmax(c, other);
                if (std::find(pairs.begin() + static_cast<std::ptrdiff_t>(first), pairs.end(), pair) ==
                    pairs.end()) {
                    pairs.push_back(pair);
                }
            }
        }
    }
    keepDistinct(pairs);
    return pairs;
}

// A shape thinner than a voxel may fall apart in the grid: pieces that share facets of tetrahedra, or a
// tetrahedron, are joined where they do.
void joinPieces(const InteriorView& view, const InteriorGrid& grid, const Cells& cells,
                std::vector<CellPair>& pairs) {
    DisjointSets pieces(cells.size());
    for (const auto& [a, b] : pairs) pieces.unite(a, b);
    std::uint32_t count = 0;
    for (std::uint32_t c = 0; c < pieces.size(); ++c) count += pieces.isRepresentative(c) ? 1 : 0;
    if (count < 2) return;
    const auto cellOf = [&](std::size_t t) {
        const std::uint32_t voxel = grid.voxelAt(view.centroids[t]);
        return voxel == InteriorGrid::kNoVoxel ? InnerDistances::kNoCell : cells.ofVoxel[voxel];
    };
    for (std::uint32_t t = 0; t < view.neighbours.size(); ++t) {
        const std::uint32_t a = cellOf(t);
        if (a == InnerDistances::kNoCell) continue;
        for (const std::uint32_t next : view.neighbours[t]) {
            if (next == kNoTetrahedron || next < t) continue;
            const std::uint32_t b = cellOf(next);
            if (b == InnerDistances::kNoCell || pieces.find(a) == pieces.find(b)) continue;
            pairs.push_back(std::minmax(a, b));
        }
    }
    for (const InteriorGrid::Matter& m : grid.matter()) {
        if (m.voxel == InteriorGrid::kNoVoxel) continue;
        const std::uint32_t a = cells.ofVoxel[m.voxel];
        const std::uint32_t b = cellOf(m.tetrahedron);
        if (b == InnerDistances::kNoCell || pieces.find(a) == pieces.find(b)) continue;
        pairs.push_back(std::minmax(a, b));
    }
    keepDistinct(pairs);
}

CellGraph graphOf(const std::vector<CellPair>& pairs, std::size_t count) {
    CellGraph graph;
    graph.begin.assign(count + 1, 0);
    for (const auto& [a, b] : pairs) {
        ++graph.begin[a + 1];
        ++graph.begin[b + 1];
    }
    std::partial_sum(graph.begin.begin(), graph.begin.end(), graph.begin.begin());
    graph.neighbours.resize(2 * pairs.size());
    std::vector<std::uint32_t> next(graph.begin.begin(), graph.begin.end() - 1);
    for (const auto& [a, b] : pairs) {
        graph.neighbours[next[a]++] = b;
        graph.neighbours[next[b]++] = a;
    }
    return graph;
}

// Bits of the three numbers in turn: places with near codes are near (Morton 1966).
std::uint64_t mortonCode(const Place& place) {
    std::uint64_t code = 0;
    for (int bit = 20; bit >= 0; --bit) {
        for (const std::int32_t p : place) code = 2 * code + ((static_cast<std::uint32_t>(p) >> bit) & 1U);
    }
    return code;
}

// At equal steps of volume along a curve that fills space.
std::vector<std::uint32_t> spreadSources(const Cells& cells, const std::vector<double>& volumes) {
    std::vector<std::pair<std::uint64_t, std::uint32_t>> order;
    double volume = 0.0;
    for (std::uint32_t c = 0; c < cells.size(); ++c) {
        order.emplace_back(mortonCode(cells.cube[c]), c);
        volume += volumes[c];
    }
    std::sort(order.begin(), order.end());
    std::vector<std::uint32_t> sources;
    double passed = 0.0;
    std::size_t i = 0;
    for (std::size_t s = 0; s < InnerDistances::kSources; ++s) {
        const double target =
            (static_cast<double>(s) + 0.5) / static_cast<double>(InnerDistances::kSources) * volume;
        while (i + 1 < order.size() && passed + volumes[order[i].second] < target) {
            passed += volumes[order[i++].second];
        }
        sources.push_back(order[i].second);
    }
    return sources;
}

double meanReached(const InnerDistances& result) {
    double sum = 0.0;
    double weight = 0.0;
    for (const auto& row : result.distance) {
        for (std::size_t c = 0; c < row.size(); ++c) {
            if (row[c] >= InnerDistances::kUnreached) continue;
            sum += row[c] * result.volumes[c];
            weight += result.volumes[c];
        }
    }
    // An interior of one cell, or of separate crumbs, has no distances: any unit will do.
    return sum > 0.0 && weight > 0.0 ? sum / weight : 1.0;
}

}  // namespace

Result<InnerDistances> innerDistances(const InteriorView& view, const RunContext& context) {
    const double side = std::cbrt(view.volume / static_cast<double>(InnerDistances::kCells));
    const InteriorGrid grid(view, side / kVoxelsPerSide);
    RETURN_IF_ERROR(context.checkpoint());
    const Cells cells = gatherCells(grid, cellSide(grid, side));
    RETURN_IF_ERROR(context.checkpoint());
    InnerDistances result;
    placeCells(grid, cells, result);
    for (const InteriorGrid::Matter& m : grid.matter()) {
        const bool placed = m.voxel != InteriorGrid::kNoVoxel;
        result.matter.push_back({m.tetrahedron, placed ? cells.ofVoxel[m.voxel] : InnerDistances::kNoCell});
    }
    std::vector<CellPair> pairs = touchingCells(grid, cells);
    RETURN_IF_ERROR(context.checkpoint());
    joinPieces(view, grid, cells, pairs);
    const CellGraph graph = graphOf(pairs, cells.size());
    result.sources = spreadSources(cells, result.volumes);
    result.distance.resize(result.sources.size());
    const auto done =
        parallelFor(result.sources.size(), kBlock, context, [&](std::size_t from, std::size_t to) {
            TautPaths paths(grid, graph, result.centres);
            for (std::size_t s = from; s < to; ++s) {
                result.distance[s] = paths.from(result.sources[s], InnerDistances::kUnreached);
            }
        });
    RETURN_IF_ERROR(done);
    result.mean = meanReached(result);
    return result;
}

}  // namespace shapedb
