// SPDX-License-Identifier: GPL-3.0-or-later
// Inserting one point into a Delaunay triangulation (Bowyer 1981, Watson 1981): remove the cells whose balls
// contain it, and join it to the facets around the hole.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/base/error.h"
#include "core/base/large_block.h"
#include "core/delaunay/cell_store.h"
#include "core/delaunay/ownership.h"
#include "core/delaunay/predicates.h"
#include "core/delaunay/start_cells.h"

namespace shapedb {

enum class Insertion {
    kInserted,
    kDuplicate,  ///< there is a vertex at the same place: nothing changed
    kNotOwned,   ///< the way to the point, or its cavity, leaves the worker's cells: nothing changed
    kStoreFull,  ///< no room for the new cells: nothing changed
};

/// What kDuplicate means to a caller: kInternal, since points are made distinct earlier.
[[nodiscard]] Error duplicatePointsError();

/// How many points a loop inserts between two looks at its RunContext.
constexpr std::size_t kInsertsBetweenCheckpoints = 1024;

/// Inserts sites, one at a time. Not thread-safe: one for each thread. Several may work on the same sites and
/// cells at once if each has an Ownership of its own.
///
/// Between two calls of `insert`: the finite cells are the Delaunay triangulation of the sites inserted so
/// far; neighbours are mutual; no cell carries kInCavity; the ball of each cell is that of its corners within
/// the margin of delaunay_ball.h, or says nothing.
class BowyerWatson {
  public:
    /// Inserts everywhere. The first walk begins at the cell `start`, which must be in use. The references
    /// must stay valid, here and below.
    BowyerWatson(LargeVector<Site>& sites, CellStore& cells, std::uint32_t start);
    /// Inserts only within what `ownership` allows.
    BowyerWatson(LargeVector<Site>& sites, CellStore& cells, const Ownership& ownership,
                 const StartCells& starts);

    /// `vertex`: a site that is not inserted yet and, with an Ownership, belongs to its worker. May throw
    /// std::bad_alloc, which leaves the triangulation unusable.
    Insertion insert(std::uint32_t vertex);

    /// A cell of the last point inserted.
    std::uint32_t lastCell() const { return hint_; }
    /// Cells of the store that are this inserter's but not in use, all marked kFreeCell.
    std::vector<std::uint32_t>& freeCells() { return free_; }

  private:
    // Corners of a cavity are numbered from 1 (0: the vertex at infinity). With fewer than this many, new
    // cells find each other in a table.
    static constexpr std::uint32_t kMaxCorners = 64;

    // A facet of the hole that removing the cavity leaves.
    struct CavityFacet {
        std::uint32_t inner;                  // the cell of the cavity that has it
        std::uint32_t outer;                  // the cell behind it, which stays
        std::uint32_t created;                // the new cell on it
        std::uint8_t index;                   // which facet of `inner` it is
        std::array<std::uint8_t, 3> corners;  // numbers of its corners, in the order of kFacet[index]
    };

    // Finding the cavity: bowyer_watson.cpp. kSerial: everything is this inserter's, nothing to check.
    template <bool kSerial>
    Insertion insertAs(std::uint32_t vertex);
    template <bool kSerial>
    bool owns(std::uint32_t cell) const;
    bool ownsByVertices(std::uint32_t cell) const;
    bool conflicts(std::uint32_t cell, const Site& p) const;
    unsigned conflictingNeighbours(std::uint32_t cell, const Site& p) const;
    template <bool kSerial>
    std::uint32_t locate(std::uint32_t vertex, const Site& p) const;
    template <bool kSerial>
    std::uint32_t walk(std::uint32_t start, const Site& p) const;
    bool hasVertexAt(std::uint32_t cell, const Site& p) const;
    bool listsHaveRoom() const;
    void growLists();
    template <bool kSerial>
    bool findCavity(std::uint32_t first, const Site& p);
    void unmarkCavity();

    // Filling it: cavity_filling.cpp. kAllOwned: every corner of the cavity is this inserter's.
    template <bool kSerial>
    bool fillCavity(std::uint32_t vertex);
    bool takeNewCells();
    void placeNewCells(std::uint32_t vertex, std::uint32_t mark);
    void markSolelyOwned();
    template <bool kAllOwned>
    void linkNewCells(std::uint32_t vertex);
    std::uint32_t numberAmong(std::uint32_t vertex, std::uint32_t count) const;
    template <bool kAllOwned>
    bool numberCorners(std::uint32_t inserted);
    void linkByTable();
    void linkByTurning();
    void linkAroundEdge(const CavityFacet& facet, std::uint32_t j);
    void computeBalls(const Site& p);

    LargeVector<Site>& sites_;
    CellStore& cells_;
    Ownership ownership_;
    const StartCells* starts_ = nullptr;  // null: everything is this inserter's
    std::uint32_t hint_;                  // where the next walk begins
    std::vector<std::uint32_t> free_;
    // Lists of which only the first `count` entries are valid; findCavity writes the next before it knows
    // whether it belongs.
    std::vector<std::uint32_t> cavity_;
    std::size_t cavityCount_ = 0;
    std::uint32_t cavityMark_ = 0;  // kSoleOwner when all cells of the cavity have it
    std::vector<CavityFacet> facets_;
    std::size_t facetCount_ = 0;
    std::array<std::uint32_t, kMaxCorners> corners_{};  // the vertex of each number
    std::uint32_t cornerCount_ = 0;
    // facetLeftOf_[a][b]: the facet to the left of the edge from corner a to corner b.
    std::array<std::array<std::uint16_t, kMaxCorners>, kMaxCorners> facetLeftOf_{};
};

}  // namespace shapedb
