#include "core/signature/inner_distances.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <queue>
#include <utility>

#include "core/segmentation/delaunay.h"

namespace shapedb {

namespace {

constexpr double kFinestCell = 1.0 / 120.0;  // thin shapes would otherwise get cells below their points

using Cube = std::array<int, 3>;

std::vector<Cube> cubes(const InteriorView& view) {
    const double side =
        std::max(kFinestCell, std::cbrt(view.volume / static_cast<double>(InnerDistances::kCells)));
    std::vector<Cube> cube;
    cube.reserve(view.centroids.size());
    const auto part = [side](double x) { return static_cast<int>(std::floor(x / side)); };
    for (const Point3& c : view.centroids) cube.push_back({part(c.x), part(c.y), part(c.z)});
    return cube;
}

// Connected lumps within one cube.
std::size_t labelCells(const InteriorView& view, std::vector<std::uint32_t>& cell) {
    const std::vector<Cube> cube = cubes(view);
    cell.assign(view.volumes.size(), kNoTetrahedron);
    std::vector<std::uint32_t> open;
    std::uint32_t count = 0;
    for (std::uint32_t seed = 0; seed < cell.size(); ++seed) {
        if (cell[seed] != kNoTetrahedron) continue;
        cell[seed] = count;
        open.push_back(seed);
        while (!open.empty()) {
            const std::uint32_t t = open.back();
            open.pop_back();
            for (const std::uint32_t next : view.neighbours[t]) {
                if (next == kNoTetrahedron || cell[next] != kNoTetrahedron || cube[next] != cube[t]) continue;
                cell[next] = count;
                open.push_back(next);
            }
        }
        ++count;
    }
    return count;
}

void placeCells(const InteriorView& view, std::size_t count, InnerDistances& result) {
    result.centres.assign(count, Point3{});
    result.volumes.assign(count, 0.0);
    for (std::size_t t = 0; t < view.volumes.size(); ++t) {
        const std::uint32_t c = result.cellOfTetrahedron[t];
        result.centres[c] = result.centres[c] + view.volumes[t] * view.centroids[t];
        result.volumes[c] += view.volumes[t];
    }
    for (std::size_t c = 0; c < count; ++c) {
        // A cell of nothing but flat tetrahedra has no volume to weigh with; it carries no weight.
        if (result.volumes[c] > 0.0) result.centres[c] = (1.0 / result.volumes[c]) * result.centres[c];
    }
}

struct Edge {
    std::uint32_t to;
    double length;
};
using Graph = std::vector<std::vector<Edge>>;

Graph joinCells(const InteriorView& view, const InnerDistances& cells) {
    std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;
    for (std::size_t t = 0; t < view.volumes.size(); ++t) {
        const std::uint32_t a = cells.cellOfTetrahedron[t];
        for (const std::uint32_t next : view.neighbours[t]) {
            if (next == kNoTetrahedron) continue;
            const std::uint32_t b = cells.cellOfTetrahedron[next];
            if (a < b && cells.volumes[a] > 0.0 && cells.volumes[b] > 0.0) pairs.emplace_back(a, b);
        }
    }
    std::sort(pairs.begin(), pairs.end());
    pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
    Graph graph(cells.centres.size());
    for (const auto& [a, b] : pairs) {
        const double d = distance(cells.centres[a], cells.centres[b]);
        graph[a].push_back({b, d});
        graph[b].push_back({a, d});
    }
    return graph;
}

std::vector<double> shortestFrom(const Graph& graph, std::uint32_t source) {
    using Entry = std::pair<double, std::uint32_t>;
    std::vector<double> distance(graph.size(), InnerDistances::kUnreached);
    std::priority_queue<Entry, std::vector<Entry>, std::greater<>> queue;
    distance[source] = 0.0;
    queue.push({0.0, source});
    while (!queue.empty()) {
        const auto [d, cell] = queue.top();
        queue.pop();
        if (d > distance[cell]) continue;
        for (const Edge& edge : graph[cell]) {
            if (d + edge.length >= distance[edge.to]) continue;
            distance[edge.to] = d + edge.length;
            queue.push({distance[edge.to], edge.to});
        }
    }
    return distance;
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
    // An interior of one cell, or of crumbs that do not touch, has no distances: any unit will do.
    return sum > 0.0 && weight > 0.0 ? sum / weight : 1.0;
}

}  // namespace

Result<InnerDistances> innerDistances(const InteriorView& view, const RunContext& context) {
    InnerDistances result;
    const std::size_t count = labelCells(view, result.cellOfTetrahedron);
    placeCells(view, count, result);
    const Graph graph = joinCells(view, result);
    for (std::size_t s = 0; s < InnerDistances::kSources; ++s) {
        if (auto ok = context.checkpoint(); !ok) return fail(ok.error());
        const std::size_t sample = s * InteriorView::kSamples / InnerDistances::kSources;
        const std::uint32_t cell = result.cellOfTetrahedron[view.innerOwner[sample]];
        result.sources.push_back(cell);
        result.distance.push_back(shortestFrom(graph, cell));
    }
    result.mean = meanReached(result);
    return result;
}

}  // namespace shapedb
