// SPDX-License-Identifier: GPL-3.0-or-later
// Inserting a site p takes five steps. If one of the first three fails, nothing has changed.
//
//   1. locate:       walk to a cell that contains p, or sees it from outside the hull.
//   2. findCavity:   from there, collect all cells in conflict with p: those whose balls contain p. They are
//                    connected, and p sees every facet around them from inside.
//   3. takeNewCells: one for each of those facets.
//   4. placeNewCells, linkNewCells: each new cell has a facet of the cavity and p. Outwards its neighbour is
//                    the cell that was behind the facet; sideways it is the new cell across the edge.
//   5. computeBalls: cache the balls of the new cells.
//
// Here are steps 1 and 2; cavity_filling.cpp has the rest. Comments state what must hold before a function
// (Pre) and what holds after it (Post). "Mine" is what the Ownership of this inserter says; when it works
// alone, everything is.
#include "core/delaunay/bowyer_watson.h"

#include "core/base/processor.h"

namespace shapedb {

namespace {

// 4 when all corners are finite.
std::uint32_t infiniteIndex(const std::array<std::uint32_t, 4>& v) {
    for (std::uint32_t i = 0; i < 4; ++i) {
        if (v[i] == kInfinite) return i;
    }
    return 4;
}

// findCavity spends half of its time waiting for memory, so what it reads next is fetched early.
void prefetchNeighbours(const CellStore& cells, std::uint32_t cell) {
    for (const std::uint32_t next : cells[cell].neighbours) {
        prefetch(&cells[next]);
        prefetch(&cells.ball(next));
    }
}

}  // namespace

Error duplicatePointsError() { return {ErrorCode::kInternal, "the points to triangulate are not distinct"}; }

BowyerWatson::BowyerWatson(LargeVector<Site>& sites, CellStore& cells, std::uint32_t start)
    : sites_(sites), cells_(cells), hint_(start), cavity_(kMaxCorners), facets_(kMaxCorners) {
    corners_[0] = kInfinite;
}

BowyerWatson::BowyerWatson(LargeVector<Site>& sites, CellStore& cells, const Ownership& ownership,
                           const StartCells& starts)
    : BowyerWatson(sites, cells, kNoCell) {
    ownership_ = ownership;
    starts_ = &starts;
}

// ---- Whose cell is it? -----------------------------------------------------------------------------------

// Pre: the cell is mine or shared, and not free. The mark settles the question for almost all cells; those at
// the border of the slab need a look at their vertices.
template <bool kSerial>
bool BowyerWatson::owns(std::uint32_t cell) const {
    return kSerial || (cells_[cell].vertices[0] & ownership_.soleOwnerMark) != 0 || ownsByVertices(cell);
}

bool BowyerWatson::ownsByVertices(std::uint32_t cell) const {
    return ownership_.ownsCell(cells_[cell].corners());
}

// ---- Is a cell in conflict with p? -----------------------------------------------------------------------

// The exact answer, for what the cached balls leave open. The ball of a cell at infinity is the half-space
// beyond its hull facet, together with the disc that the facet's circle bounds: what the ball of a finite
// cell tends to as its fourth corner moves away. Never undecided, thanks to the symbolic perturbation.
bool BowyerWatson::conflicts(std::uint32_t cell, const Site& p) const {
    const std::array<std::uint32_t, 4> w = cells_[cell].corners();
    if (isFinite(w)) return sideOfSphere(sites_[w[0]], sites_[w[1]], sites_[w[2]], sites_[w[3]], p) > 0;
    const auto& f = kFacet[infiniteIndex(w)];
    const Site& a = sites_[w[f[0]]];
    const Site& b = sites_[w[f[1]]];
    const Site& c = sites_[w[f[2]]];
    const int side = orientation(a, b, c, p);
    return side != 0 ? side > 0 : sideOfCircle(a, b, c, p) > 0;
}

// Bit i: neighbour i is in conflict with p. Means nothing for neighbours that are in the cavity already: the
// caller knows about them, and they are not worth an exact predicate.
// Pre: the cell is mine, so its neighbours are mine or shared and nobody is changing them.
unsigned BowyerWatson::conflictingNeighbours(std::uint32_t cell, const Site& p) const {
    const auto& neighbours = cells_[cell].neighbours;
    unsigned conflicting = 0;
    unsigned unknown = 0;
    for (std::uint32_t i = 0; i < 4; i += 2) {
        const Containment two = ballsContain(cells_.ball(neighbours[i]), cells_.ball(neighbours[i + 1]), p);
        conflicting |= two.inside << i;
        unknown |= two.unknown << i;
    }
    for (std::uint32_t i = 0; unknown != 0 && i < 4; ++i) {
        if ((unknown >> i & 1u) == 0 || (cells_[neighbours[i]].vertices[0] & kInCavity) != 0) continue;
        if (conflicts(neighbours[i], p)) conflicting |= 1u << i;
    }
    return conflicting;
}

// ---- Step 1: locate --------------------------------------------------------------------------------------

// Post: a cell that contains p (its closure does), or a cell at infinity whose hull facet p lies strictly
// beyond; kNoCell when no walk got there. With an Ownership the cell may be shared: the caller has to ask.
template <bool kSerial>
std::uint32_t BowyerWatson::locate(std::uint32_t vertex, const Site& p) const {
    if (kSerial) return walk<kSerial>(hint_, p);
    // Sites come along the Hilbert curve, so the last one is mostly a few cells away.
    std::uint32_t found = hint_ != kNoCell ? walk<kSerial>(hint_, p) : kNoCell;
    if (found != kNoCell) return found;
    // The cells a worker may cross can fall into several pieces that no walk connects, for instance the two
    // legs of a chair in one slab. Vertices with close numbers mostly lie in the same piece.
    starts_->visitNear(vertex, [&](std::uint32_t start) {
        if (cells_[start].isFree() || !owns<kSerial>(start)) return false;
        found = walk<kSerial>(start, p);
        return found != kNoCell;
    });
    return found;
}

// The visibility walk: leave a cell through any facet that has p strictly on its other side. In a Delaunay
// triangulation no such walk visits a cell twice (Edelsbrunner 1990), so it ends.
//
// Pre: `start` is in use, and mine. Post: as locate.
//
// A worker steps only through open facets, those of which it owns two vertices. What lies behind them is
// mine or shared, and nobody else writes these neighbour entries: as far as the walk can see, the
// triangulation stands still. When all facets that separate p from the cell are closed, it gives up.
template <bool kSerial>
std::uint32_t BowyerWatson::walk(std::uint32_t start, const Site& p) const {
    std::uint32_t cell = start;
    // A cell at infinity is no place to start from; the finite cell behind its hull facet is. That facet is
    // open: at least three vertices of `start` are mine, none of which is the one at infinity.
    const std::uint32_t outside = infiniteIndex(cells_[cell].corners());
    if (outside != 4) cell = cells_[cell].neighbours[outside];
    std::uint32_t from = kNoCell;
    for (;;) {
        const std::array<std::uint32_t, 4> v = cells_[cell].corners();
        if (!isFinite(v)) return cell;  // we left the hull through the facet that this cell closes
        const bool allOpen = owns<kSerial>(cell);
        std::uint32_t to = kNoCell;
        bool blocked = false;
        for (std::uint32_t i = 0; i < 4 && to == kNoCell; ++i) {
            const auto& f = kFacet[i];
            const std::uint32_t a = v[f[0]];
            const std::uint32_t b = v[f[1]];
            const std::uint32_t c = v[f[2]];
            const bool open = allOpen || ownership_.ownsTwoOf(a, b, c);
            // The facet we came through has p on this side.
            if (open && cells_[cell].neighbours[i] == from) continue;
            if (orientation(sites_[a], sites_[b], sites_[c], p) >= 0) continue;
            if (open) {
                to = cells_[cell].neighbours[i];
            } else {
                blocked = true;
            }
        }
        if (to == kNoCell) return blocked ? kNoCell : cell;
        from = cell;
        cell = to;
    }
}

// Pre: p was located in the cell. Then a site at the same place can only be one of its corners.
bool BowyerWatson::hasVertexAt(std::uint32_t cell, const Site& p) const {
    for (const std::uint32_t v : cells_[cell].corners()) {
        if (v != kInfinite && samePlace(sites_[v], p)) return true;
    }
    return false;
}

// ---- Step 2: the cavity ----------------------------------------------------------------------------------

// Whether there is room for the four cells and facets that one cell of the cavity can add.
bool BowyerWatson::listsHaveRoom() const {
    return cavityCount_ + 4 <= cavity_.size() && facetCount_ + 4 <= facets_.size();
}

void BowyerWatson::growLists() {
    cavity_.resize(2 * cavity_.size());
    facets_.resize(2 * facets_.size());
}

// Breadth-first search over the cells in conflict with p.
//
// Pre:  `first` is mine and in conflict with p; no cell of mine is marked kInCavity.
// Post: exactly the first `cavityCount_` cells of `cavity_` are marked. If true: they are all the cells in
//       conflict with p and all mine; the first `facetCount_` entries of `facets_` are the facets between
//       them and the rest; `cavityMark_` is set. If false: a shared cell is in conflict, too, and the caller
//       has to unmark.
//
// Before each round of the outer loop, cells 0 .. k - 1 of the cavity have had all their neighbours judged,
// and `facets_` holds those of their facets that face a cell without conflict.
//
// Whether a ball contains p is as good as random, so branches on it would be mispredicted: the four
// neighbours of a cell are judged together, both lists are written at their ends whatever the answer, and the
// answer only decides which of them gets longer.
template <bool kSerial>
bool BowyerWatson::findCavity(std::uint32_t first, const Site& p) {
    cavity_[0] = first;
    cavityCount_ = 1;
    facetCount_ = 0;
    const std::uint32_t soleOwner = ownership_.soleOwnerMark;
    std::uint32_t mark = cells_[first].vertices[0] & soleOwner;
    cells_[first].vertices[0] |= kInCavity;
    prefetchNeighbours(cells_, first);
    for (std::size_t k = 0; k < cavityCount_; ++k) {
        if (!listsHaveRoom()) growLists();
        const std::uint32_t cell = cavity_[k];
        const unsigned conflicting = conflictingNeighbours(cell, p);
        for (std::uint32_t i = 0; i < 4; ++i) {
            const std::uint32_t next = cells_[cell].neighbours[i];
            const std::uint32_t head = cells_[next].vertices[0];
            const unsigned unseen = (head & kInCavity) == 0 ? 1 : 0;
            const unsigned joins = unseen & (conflicting >> i);
            cavity_[cavityCount_] = next;
            facets_[facetCount_] = {cell, next, kNoCell, static_cast<std::uint8_t>(i), {}};
            if (joins != 0) {
                if (!kSerial && (head & soleOwner) == 0) {
                    if (!ownsByVertices(next)) return false;
                    mark = 0;
                }
                cells_[next].vertices[0] = head | kInCavity;
                prefetchNeighbours(cells_, next);
            }
            cavityCount_ += joins;
            facetCount_ += unseen & ~joins;
        }
    }
    cavityMark_ = mark;
    return true;
}

// Pre: findCavity came back. Post: no cell of mine is marked kInCavity.
void BowyerWatson::unmarkCavity() {
    for (std::size_t i = 0; i < cavityCount_; ++i) cells_[cavity_[i]].vertices[0] &= ~kInCavity;
}

// ---- All steps -------------------------------------------------------------------------------------------

template <bool kSerial>
Insertion BowyerWatson::insertAs(std::uint32_t vertex) {
    const Site p = sites_[vertex];
    const std::uint32_t first = locate<kSerial>(vertex, p);
    if (first == kNoCell || !owns<kSerial>(first)) return Insertion::kNotOwned;
    if (hasVertexAt(first, p)) return Insertion::kDuplicate;
    // A cell that contains p is in conflict with it, and so is one at infinity that p lies beyond.
    if (!findCavity<kSerial>(first, p)) {
        unmarkCavity();
        return Insertion::kNotOwned;
    }
    if (!fillCavity<kSerial>(vertex)) {
        unmarkCavity();
        return Insertion::kStoreFull;
    }
    return Insertion::kInserted;
}

Insertion BowyerWatson::insert(std::uint32_t vertex) {
    return starts_ == nullptr ? insertAs<true>(vertex) : insertAs<false>(vertex);
}

}  // namespace shapedb
