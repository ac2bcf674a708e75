#include "core/signature/inner_distances.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>

#include "core/base/parallel.h"
#include "core/base/return_if_error.h"
#include "core/delaunay/delaunay.h"

namespace shapedb {

namespace {

// Thin shapes would otherwise get cells smaller than the spacing of their points.
constexpr double kFinestCell = 1.0 / 120.0;

constexpr std::size_t kBlock = 16;  // sources per task

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

// Assigns each tetrahedron to a cell: a connected lump within one cube. Returns the number of cells.
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
        // A cell of flat tetrahedra only has no volume and carries no weight.
        if (result.volumes[c] > 0.0) result.centres[c] = (1.0 / result.volumes[c]) * result.centres[c];
    }
}

struct Edge {
    std::uint32_t to;
    double length;
};

// The edges, grouped by cell.
struct Graph {
    std::vector<Edge> edges;
    std::vector<std::uint32_t> begin;  // of each cell's edges; one more marks the end

    std::size_t size() const { return begin.size() - 1; }
};

Graph joinCells(const InteriorView& view, const InnerDistances& cells) {
    std::vector<std::pair<std::uint32_t, std::uint32_t>> pairs;
    for (std::size_t t = 0; t < view.volumes.size(); ++t) {
        const std::uint32_t a = cells.cellOfTetrahedron[t];
        for (const std::uint32_t next : view.neighbours[t]) {
            if (next == kNoTetrahedron) continue;
            const std::uint32_t b = cells.cellOfTetrahedron[next];
            // A cell without volume has no centre to measure from.
            if (a < b && cells.volumes[a] > 0.0 && cells.volumes[b] > 0.0) pairs.emplace_back(a, b);
        }
    }
    std::sort(pairs.begin(), pairs.end());
    pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
    Graph graph;
    graph.begin.assign(cells.centres.size() + 1, 0);
    for (const auto& [a, b] : pairs) {
        ++graph.begin[a + 1];
        ++graph.begin[b + 1];
    }
    std::partial_sum(graph.begin.begin(), graph.begin.end(), graph.begin.begin());
    graph.edges.resize(2 * pairs.size());
    std::vector<std::uint32_t> next(graph.begin.begin(), graph.begin.end() - 1);
    for (const auto& [a, b] : pairs) {
        const double d = distance(cells.centres[a], cells.centres[b]);
        graph.edges[next[a]++] = {b, d};
        graph.edges[next[b]++] = {a, d};
    }
    return graph;
}

// Shortest paths from one cell to all, with a bucket queue (Dial, "Shortest-path forest with topological
// ordering", 1969): cells are visited by distance in steps of about an edge, and within a step perhaps more
// than once. The result, the smallest sum over all paths added up from the source, does not depend on the
// order.
class ShortestPaths {
  public:
    explicit ShortestPaths(const Graph& graph) : graph_(graph) {
        double sum = 0.0;
        for (const Edge& edge : graph.edges) sum += edge.length;
        if (sum > 0.0) stepsPerLength_ = 2.0 * static_cast<double>(graph.edges.size()) / sum;
    }

    std::vector<double> from(std::uint32_t source) {
        std::vector<double> distance(graph_.size(), InnerDistances::kUnreached);
        distance[source] = 0.0;
        put({0.0, source});
        for (std::size_t step = 0; step < steps_.size(); ++step) {
            while (!steps_[step].empty()) {
                const Entry entry = steps_[step].back();
                steps_[step].pop_back();
                if (entry.distance > distance[entry.cell]) continue;  // a shorter path was found since
                relaxEdges(entry, distance);
            }
        }
        return distance;
    }

  private:
    struct Entry {
        double distance;
        std::uint32_t cell;
    };

    // Never before the current step, since distances only grow.
    void put(Entry entry) {
        const auto step = static_cast<std::size_t>(entry.distance * stepsPerLength_);
        if (step >= steps_.size()) steps_.resize(step + 1);
        steps_[step].push_back(entry);
    }

    void relaxEdges(const Entry& entry, std::vector<double>& distance) {
        for (std::uint32_t e = graph_.begin[entry.cell]; e < graph_.begin[entry.cell + 1]; ++e) {
            const Edge& edge = graph_.edges[e];
            const double length = entry.distance + edge.length;
            if (length >= distance[edge.to]) continue;
            distance[edge.to] = length;
            put({length, edge.to});
        }
    }

    const Graph& graph_;
    double stepsPerLength_ = 1.0;
    std::vector<std::vector<Entry>> steps_;  // cells to visit, by distance
};

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
    InnerDistances result;
    const std::size_t count = labelCells(view, result.cellOfTetrahedron);
    placeCells(view, count, result);
    const Graph graph = joinCells(view, result);
    for (std::size_t s = 0; s < InnerDistances::kSources; ++s) {
        // Samples are stratified, and every n-th of them still is.
        const std::size_t sample = s * InteriorView::kSamples / InnerDistances::kSources;
        result.sources.push_back(result.cellOfTetrahedron[view.sampled[sample]]);
    }
    result.distance.resize(result.sources.size());
    const auto done =
        parallelFor(result.sources.size(), kBlock, context, [&](std::size_t from, std::size_t to) {
            ShortestPaths paths(graph);
            for (std::size_t s = from; s < to; ++s) result.distance[s] = paths.from(result.sources[s]);
        });
    RETURN_IF_ERROR(done);
    result.mean = meanReached(result);
    return result;
}

}  // namespace shapedb
