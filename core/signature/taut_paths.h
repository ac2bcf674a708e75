// SPDX-License-Identifier: GPL-3.0-or-later
// Shortest paths from one place of the interior to all its cells, as a taut string would run.
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include "core/geometry/point.h"
#include "core/signature/interior_grid.h"

namespace shapedb {

/// Which cells touch: the neighbours of each, ascending.
struct CellGraph {
    std::vector<std::uint32_t> neighbours;
    std::vector<std::uint32_t> begin;  ///< of each cell's neighbours; one more marks the end
};

/// Lazy Theta* (Nash, Koenig and Tovey 2010) from a source to everywhere: a cell that sees the last turn of
/// its neighbour's path is reached from there, whatever lies between. Where it does not, the path turns near
/// the neighbour, as close to the straight line as the wall permits. Holds buffers: one per thread.
class TautPaths {
  public:
    /// References are kept.
    TautPaths(const InteriorGrid& grid, const CellGraph& graph, const PointCloud& centres);

    /// Lengths from the centre of a cell to those of all, `unreached` where no path leads.
    [[nodiscard]] std::vector<double> from(std::uint32_t source, double unreached);

  private:
    // Where a path bends; the first is the source.
    struct Turn {
        Point3 at;
        double length;  // of the path so far
    };
    struct State {
        double length;
        std::uint32_t turn;
        enum : std::uint8_t { kUnknown, kTentative, kSeen, kDone } stage;
    };
    using Entry = std::pair<double, std::uint32_t>;

    void put(std::uint32_t cell, double length, std::uint32_t turn, bool seen);
    void relax(std::uint32_t cell);
    void turnTowards(std::uint32_t cell);
    [[nodiscard]] Point3 tautTurn(const Point3& last, const Point3& bend, const Point3& to) const;
    [[nodiscard]] double lengthVia(std::uint32_t turn, std::uint32_t cell) const;

    const InteriorGrid& grid_;
    const CellGraph& graph_;
    const PointCloud& centres_;
    std::vector<Turn> turns_;
    std::vector<State> states_;
    std::vector<Entry> open_;  // a heap, the shortest first
};

}  // namespace shapedb
