// The incremental Delaunay triangulation on flat arrays: the tetrahedra and how a point goes in.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/base/large_block.h"
#include "core/segmentation/delaunay_ball.h"
#include "core/segmentation/predicates.h"

namespace shapedb {

/// The vertex at infinity, which closes the triangulation outside the hull.
constexpr std::uint32_t kInfinite = 0x3fffffffu;
/// Mark on the first vertex of a cell while a point goes in; set in a free one.
constexpr std::uint32_t kInCavity = 0x80000000u;
constexpr std::uint32_t kFreeCell = 0xffffffffu;
constexpr std::uint32_t kNoCell = 0xffffffffu;
constexpr std::uint32_t kVertexBits = 0x3fffffffu;

/// A tetrahedron, half a cache line. Neighbour i is opposite vertex i; vertices are positively
/// oriented (with the one at infinity: if it were moved to a point beyond the other three).
struct alignas(32) Cell {
    std::array<std::uint32_t, 4> vertices;
    std::array<std::uint32_t, 4> neighbours;
};

/// The cells and their balls in a block of memory each, taken from the front. Pages nobody took are never
/// touched.
class CellStore {
  public:
    /// Makes room for as many cells; what is there stays. Not while another thread takes any.
    void reserve(std::size_t capacity);
    /// `count` cells that follow one another, kNoCell when there is no room.
    std::uint32_t take(std::uint32_t count);

    Cell& operator[](std::uint32_t i) { return cells_[i]; }
    const Cell& operator[](std::uint32_t i) const { return cells_[i]; }
    DelaunayBall& ball(std::uint32_t i) { return balls_[i]; }
    const DelaunayBall& ball(std::uint32_t i) const { return balls_[i]; }
    /// Frees the balls, when nothing more is inserted.
    void dropBalls() { balls_.reset(); }
    std::size_t used() const { return used_.load(std::memory_order_relaxed); }
    std::size_t capacity() const { return capacity_; }

  private:
    LargeBlock<Cell> cells_;
    LargeBlock<DelaunayBall> balls_;
    std::atomic<std::size_t> used_{0};
    std::size_t capacity_ = 0;
};

/// Which vertices belong to a worker: [begin, end), and those below `wrapped`. The one at infinity
/// belongs to every worker, a cell to the worker that all its vertices belong to.
///
/// Workers with disjoint vertices may insert at the same time without locks: no cell of one is next to
/// a cell of another (they would share three vertices), what lies between belongs to nobody and keeps its
/// vertices, and of its four neighbours each worker changes only those behind facets of its own vertices.
struct VertexRange {
    std::uint32_t begin = 0;
    std::uint32_t end = kInfinite;
    std::uint32_t wrapped = 0;

    bool holds(std::uint32_t v) const { return v - begin < end - begin || v < wrapped || v == kInfinite; }
};

enum class Insertion {
    kDone,
    kRepeated,   ///< there is a vertex at the same place
    kElsewhere,  ///< the cavity, or the way to it, leaves the worker's cells: nothing was changed
    kNoRoom,     ///< the store is full: nothing was changed
};

/// Inserts points one at a time (Bowyer 1981, Watson 1981). One for each thread.
class CavityInserter {
  public:
    /// `start`: a cell of `range`, where the first walk begins.
    CavityInserter(LargeVector<Site>& sites, CellStore& cells, const VertexRange& range, std::uint32_t start);

    /// Inserts the site `vertex`, which must be in range.
    Insertion insert(std::uint32_t vertex);

    /// A cell of the last point inserted.
    std::uint32_t lastCell() const { return hint_; }
    /// Cells this worker took and does not use, marked as free.
    std::vector<std::uint32_t>& freeCells() { return free_; }

  private:
    // Corners of cavities have numbers of their own; up to this many, facets meet in a table.
    static constexpr std::uint32_t kMostCorners = 64;

    struct Facet {
        std::uint32_t cell;                   // inside the cavity
        std::uint32_t beyond;                 // outside of it
        std::uint32_t fresh;                  // the new cell on it
        std::uint8_t index;                   // of the facet in `cell`
        std::array<std::uint8_t, 3> corners;  // numbers of its corners, seen from inside
    };

    bool owns(std::uint32_t cell) const;
    bool conflicts(std::uint32_t cell, const Site& p) const;
    unsigned neighboursHolding(std::uint32_t cell, const Site& p) const;
    void makeRoom();
    std::uint32_t locate(const Site& p) const;
    bool isVertexOf(std::uint32_t cell, const Site& p) const;
    bool findCavity(std::uint32_t first, const Site& p);
    void unmark();
    bool takeFresh();
    void fillCavity(std::uint32_t vertex);
    void placeFresh(std::uint32_t vertex);
    void measureBalls(const Site& p);
    bool numberCorners(std::uint32_t inserted);
    void linkByTable();
    void linkByTurning();
    void linkAround(const Facet& facet, std::uint32_t j);

    LargeVector<Site>& sites_;
    CellStore& cells_;
    VertexRange range_;
    bool alone_;  // everything is in range
    std::uint32_t hint_;
    std::vector<std::uint32_t> free_;
    // Lists with room to spare at the end, where entries are written before it is known whether they count.
    std::vector<std::uint32_t> cavity_;
    std::size_t cavityCount_ = 0;
    std::vector<Facet> facets_;
    std::size_t facetCount_ = 0;
    std::array<std::uint32_t, kMostCorners> corners_{};  // the vertex of each number
    std::uint32_t cornerCount_ = 0;
    // For an edge from one corner to another: the facet to its left.
    std::array<std::array<std::uint16_t, kMostCorners>, kMostCorners> sides_{};
};

}  // namespace shapedb
