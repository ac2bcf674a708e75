// The incremental Delaunay triangulation on flat arrays: the tetrahedra and how a point goes in.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

#include "core/base/error.h"
#include "core/base/large_block.h"
#include "core/delaunay/delaunay_ball.h"
#include "core/delaunay/predicates.h"

namespace shapedb {

/// The vertex at infinity, which closes the triangulation outside the hull.
constexpr std::uint32_t kInfinite = 0x3fffffffu;
/// Mark on the first vertex of a cell while a point goes in; set in a free one.
constexpr std::uint32_t kInCavity = 0x80000000u;
/// Mark on the first vertex of a cell whose vertices all belong to one worker. No other comes there, so whose
/// it is needs no question.
constexpr std::uint32_t kInner = 0x40000000u;
constexpr std::uint32_t kFreeCell = 0xffffffffu;
constexpr std::uint32_t kNoCell = 0xffffffffu;
constexpr std::uint32_t kVertexBits = 0x3fffffffu;

/// A tetrahedron, half a cache line. Neighbour i is opposite vertex i; vertices are positively
/// oriented (with the one at infinity: if it were moved to a point beyond the other three).
struct alignas(32) Cell {
    std::array<std::uint32_t, 4> vertices;  // the first with marks
    std::array<std::uint32_t, 4> neighbours;

    std::uint32_t firstVertex() const { return vertices[0] & kVertexBits; }
    /// The vertices without marks.
    std::array<std::uint32_t, 4> corners() const {
        return {firstVertex(), vertices[1], vertices[2], vertices[3]};
    }
};

/// Whether none of a cell's corners is the vertex at infinity; false for a free cell. Without branches.
inline bool isFinite(const std::array<std::uint32_t, 4>& corners) {
    return (static_cast<unsigned>(corners[0] < kInfinite) & static_cast<unsigned>(corners[1] < kInfinite) &
            static_cast<unsigned>(corners[2] < kInfinite) & static_cast<unsigned>(corners[3] < kInfinite)) !=
           0;
}

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
    /// The memory of the balls, when nothing more is inserted, and that of the cells, when they are not
    /// needed.
    SpentBlock giveUpBalls() { return SpentBlock(std::move(balls_)); }
    SpentBlock giveUpCells() { return SpentBlock(std::move(cells_)); }
    std::size_t used() const { return used_.load(std::memory_order_relaxed); }
    std::size_t capacity() const { return capacity_; }

  private:
    LargeBlock<Cell> cells_;
    LargeBlock<DelaunayBall> balls_;
    std::atomic<std::size_t> used_{0};
    std::size_t capacity_ = 0;
};

/// Which vertices belong to a worker. The one at infinity belongs to nobody, a cell to the worker that three
/// of its vertices belong to, or all four.
///
/// Workers may insert at the same time without locks. Of the vertices of a facet of its own cells at least
/// two belong to a worker, so no cell of one is next to a cell of another. What lies between belongs to
/// nobody and keeps its vertices, and of its four neighbours each worker changes only those behind facets
/// with two vertices of its own.
struct Ownership {
    const std::uint8_t* workers = nullptr;  ///< by vertex
    std::uint8_t worker = 0;
    std::uint32_t innerMark = 0;  ///< kInner when cells have that mark now, 0 when it means nothing

    bool holds(std::uint32_t v) const { return v != kInfinite && workers[v] == worker; }
    bool holdsTwo(std::uint32_t a, std::uint32_t b, std::uint32_t c) const {
        return count(a) + count(b) + count(c) >= 2;
    }
    bool holdsThree(const std::array<std::uint32_t, 4>& v) const { return count(v) >= 3; }
    bool holdsAll(const std::array<std::uint32_t, 4>& v) const { return count(v) == 4; }

  private:
    unsigned count(std::uint32_t v) const { return holds(v) ? 1 : 0; }
    unsigned count(const std::array<std::uint32_t, 4>& v) const {
        return count(v[0]) + count(v[1]) + count(v[2]) + count(v[3]);
    }
};

/// Some cells of one worker all along the order of the vertices, to walk from when the way from the last
/// point inserted is barred. They may be free by now.
class StartCells {
  public:
    explicit StartCells(std::size_t siteCount) : siteCount_(siteCount), cells_(kSlots, kNoCell) {}

    /// `vertex`: one of its corners.
    void add(std::uint32_t vertex, std::uint32_t cell) { cells_[slotOf(vertex)] = cell; }
    /// Calls `visit(cell)` with those around a vertex, the nearest first, until it returns true.
    template <typename Visit>
    void visitAround(std::uint32_t vertex, const Visit& visit) const {
        const auto see = [&](std::size_t slot) { return cells_[slot] != kNoCell && visit(cells_[slot]); };
        const std::size_t middle = slotOf(vertex);
        for (std::size_t away = 0; away <= kReach; ++away) {
            if (middle + away < kSlots && see(middle + away)) return;
            if (away != 0 && away <= middle && see(middle - away)) return;
        }
    }

    static constexpr std::size_t kSlots = 4096;

  private:
    static constexpr std::size_t kReach = 3;  // slots to either side

    std::size_t slotOf(std::uint32_t vertex) const { return vertex * kSlots / siteCount_; }

    std::size_t siteCount_;
    std::vector<std::uint32_t> cells_;
};

enum class Insertion {
    kDone,
    kRepeated,   ///< there is a vertex at the same place
    kElsewhere,  ///< the cavity, or the way to it, leaves the worker's cells: nothing was changed
    kNoRoom,     ///< the store is full: nothing was changed
};

/// What kRepeated means to a caller: kInternal, since points are made distinct before.
[[nodiscard]] Error notDistinct();

/// So often who inserts many asks whether to go on.
constexpr std::size_t kInsertsBetweenCheckpoints = 1024;

/// Inserts points one at a time (Bowyer 1981, Watson 1981). One for each thread.
class BowyerWatson {
  public:
    /// All of them, the first walk beginning at the cell `start`.
    BowyerWatson(LargeVector<Site>& sites, CellStore& cells, std::uint32_t start);
    /// A worker's. What it is given must live as long as this.
    BowyerWatson(LargeVector<Site>& sites, CellStore& cells, const Ownership& share,
                 const StartCells& starts);

    /// Inserts the site `vertex`, which must be in the share.
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

    // kAlone: everything is this one's, which needs no questions.
    template <bool kAlone>
    Insertion insertAs(std::uint32_t vertex);
    template <bool kAlone>
    bool owns(std::uint32_t cell) const;
    bool ownsAtBorder(std::uint32_t cell) const;
    bool conflicts(std::uint32_t cell, const Site& p) const;
    unsigned neighboursHolding(std::uint32_t cell, const Site& p) const;
    void makeRoom();
    template <bool kAlone>
    std::uint32_t locate(std::uint32_t vertex, const Site& p) const;
    template <bool kAlone>
    std::uint32_t walk(std::uint32_t start, const Site& p) const;
    bool isVertexOf(std::uint32_t cell, const Site& p) const;
    template <bool kAlone>
    bool findCavity(std::uint32_t first, const Site& p);
    void unmark();
    bool takeFresh();
    template <bool kAlone>
    void fillCavity(std::uint32_t vertex);
    // kOurs: all corners of the cavity are this one's.
    template <bool kOurs>
    void joinFresh(std::uint32_t vertex);
    void placeFresh(std::uint32_t vertex, std::uint32_t mark);
    void markInner();
    void measureBalls(const Site& p);
    std::uint32_t numberAmong(std::uint32_t vertex, std::uint32_t count) const;
    template <bool kOurs>
    bool numberCorners(std::uint32_t inserted);
    void linkByTable();
    void linkByTurning();
    void linkAround(const Facet& facet, std::uint32_t j);

    LargeVector<Site>& sites_;
    CellStore& cells_;
    Ownership share_;
    const StartCells* starts_ = nullptr;  // none: everything is this one's
    std::uint32_t hint_;
    std::vector<std::uint32_t> free_;
    // Lists with room to spare at the end, where entries are written before it is known whether they count.
    std::vector<std::uint32_t> cavity_;
    std::size_t cavityCount_ = 0;
    std::uint32_t cavityMark_ = 0;  // kInner when all cells of the cavity have it
    std::vector<Facet> facets_;
    std::size_t facetCount_ = 0;
    std::array<std::uint32_t, kMostCorners> corners_{};  // the vertex of each number
    std::uint32_t cornerCount_ = 0;
    // For an edge from one corner to another: the facet to its left.
    std::array<std::array<std::uint16_t, kMostCorners>, kMostCorners> sides_{};
};

}  // namespace shapedb
