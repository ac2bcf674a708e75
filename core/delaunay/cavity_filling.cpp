// SPDX-License-Identifier: GPL-3.0-or-later
// Steps 3 to 5 of an insertion (bowyer_watson.cpp): the cells of the cavity give way to new ones that join
// its facets to the inserted site p.
//
// The facets of a cavity form a closed surface, and p sees all of it from inside. So the new cells have the
// structure of that surface: one cell for each facet, neighbours where facets share an edge.
#include <algorithm>

#include "core/delaunay/bowyer_watson.h"

namespace shapedb {

namespace {

// Cells an inserter takes from the store at a time.
constexpr std::uint32_t kBatch = 256;

}  // namespace

// ---- Step 3: take the new cells --------------------------------------------------------------------------

// Pre:  findCavity returned true.
// Post: if true, each facet has a cell of its own in `created`, which was free. If false, the store is full
//       and no facet has got one.
bool BowyerWatson::takeNewCells() {
    while (free_.size() < facetCount_) {
        const std::uint32_t batch = cells_.take(kBatch);
        if (batch == kNoCell) return false;
        // Backwards, so that they are used from the front.
        for (std::uint32_t i = kBatch; i-- > 0;) {
            cells_[batch + i].vertices[0] = kFreeCell;
            free_.push_back(batch + i);
        }
    }
    for (std::size_t f = 0; f < facetCount_; ++f) {
        CavityFacet& facet = facets_[f];
        facet.created = free_.back();
        free_.pop_back();
    }
    return true;
}

// ---- Step 4: place and link them -------------------------------------------------------------------------

// Writes the vertices of the new cells, the first with `mark`, and links them to the cells outside.
//
// Pre:  takeNewCells returned true.
// Post: a new cell has the vertices of its inner cell, with the inserted one instead of the vertex opposite
//       the facet; the orientation stays positive, since p is on the same side of the facet. It and the outer
//       cell are neighbours. Its other three neighbours are not set. The cells of the cavity are as they
//       were.
//
// Which neighbour of the outer cell we are is found from its vertices: the entry opposite its apex, the one
// vertex that the facet lacks. (All four vertices but the apex are those of the facet, so exclusive or of
// both sets leaves the apex.) Searching its neighbours for the inner cell would read entries that other
// workers may be writing.
void BowyerWatson::placeNewCells(std::uint32_t vertex, std::uint32_t mark) {
    for (std::size_t f = 0; f < facetCount_; ++f) {
        const CavityFacet& facet = facets_[f];
        Cell& created = cells_[facet.created];
        created.vertices = cells_[facet.inner].corners();
        auto& v = created.vertices;
        const std::uint32_t shared = v[0] ^ v[1] ^ v[2] ^ v[3] ^ v[facet.index];
        Cell& outer = cells_[facet.outer];
        const auto& w = outer.vertices;
        const std::uint32_t apex = outer.firstVertex() ^ w[1] ^ w[2] ^ w[3] ^ shared;
        outer.neighbours[indexOf(w, apex)] = facet.created;
        v[facet.index] = vertex;
        v[0] |= mark;
        created.neighbours[facet.index] = facet.outer;
    }
}

// Pre: placeNewCells ran with no mark. Post: new cells whose vertices are all mine are marked so. Only needed
// when some cell of the cavity was not: if all were, all of the new cells are, and placeNewCells marked them.
void BowyerWatson::markSolelyOwned() {
    for (std::size_t f = 0; f < facetCount_; ++f) {
        Cell& created = cells_[facets_[f].created];
        if (ownership_.ownsAllOf(created.vertices)) created.vertices[0] |= ownership_.soleOwnerMark;
    }
}

// The number of a corner among those below `count`; kMaxCorners if it has none.
std::uint32_t BowyerWatson::numberAmong(std::uint32_t vertex, std::uint32_t count) const {
    const auto* const begin = corners_.begin();
    const auto* const at = std::find(begin + 1, begin + count, vertex);
    return at == begin + count ? kMaxCorners : static_cast<std::uint32_t>(at - begin);
}

// Numbers the corners of the cavity from 1, in the order in which the facets bring them; the vertex at
// infinity is 0.
//
// Pre:  kAllOwned implies that all finite corners are mine.
// Post: if true, corners_[n] for n < cornerCount_ is the vertex of number n, and facet.corners[k] the number
//       of corner kFacet[facet.index][k]. If false there are too many, and the numbers mean nothing.
//
// A site of mine remembers its number in its mark, together with the inserted vertex for which it was
// numbered: Site::mark = (inserted + 1) * kMaxCorners + number. No two insertions share a vertex, so marks
// never need clearing. Marks of other sites belong to their workers; those few corners are looked up in the
// list.
template <bool kAllOwned>
bool BowyerWatson::numberCorners(std::uint32_t inserted) {
    const std::uint64_t mark = (std::uint64_t{inserted} + 1) * kMaxCorners;
    std::uint32_t count = 1;
    for (std::size_t f = 0; f < facetCount_; ++f) {
        CavityFacet& facet = facets_[f];
        const auto& v = cells_[facet.inner].vertices;
        for (std::uint32_t k = 0; k < 3; ++k) {
            const std::uint32_t vertex = v[kFacet[facet.index][k]] & kVertexBits;
            if (vertex == kInfinite) {
                facet.corners[k] = 0;
                continue;
            }
            if (count == kMaxCorners) return false;
            const bool mine = kAllOwned || ownership_.ownsVertex(vertex);
            // Wraps around to something large for a mark of another insertion.
            const std::uint64_t known = mine ? sites_[vertex].mark - mark : numberAmong(vertex, count);
            const bool isNew = known >= kMaxCorners;
            const std::uint64_t number = isNew ? count : known;
            corners_[count] = vertex;  // overwritten by the next corner unless this one is new
            if (mine) sites_[vertex].mark = mark + number;
            count += isNew ? 1 : 0;
            facet.corners[k] = static_cast<std::uint8_t>(number);
        }
    }
    cornerCount_ = count;
    return true;
}

// Links the new cells among each other, through a table of edges.
//
// Pre:  placeNewCells ran, numberCorners returned true. Post: all neighbours of the new cells are set.
//
// Seen from inside, the surface of the cavity is oriented, so each of its edges is walked once in either
// direction: facet (c0, c1, c2) has on its left the edges c0 -> c1, c1 -> c2 and c2 -> c0, and the facet
// across c0 -> c1 is the one to the left of c1 -> c0. The table is never cleared: every entry read was
// written for this cavity.
void BowyerWatson::linkByTable() {
    for (std::size_t f = 0; f < facetCount_; ++f) {
        const auto& c = facets_[f].corners;
        const auto number = static_cast<std::uint16_t>(f);
        facetLeftOf_[c[0]][c[1]] = number;
        facetLeftOf_[c[1]][c[2]] = number;
        facetLeftOf_[c[2]][c[0]] = number;
    }
    for (std::size_t f = 0; f < facetCount_; ++f) {
        const CavityFacet& facet = facets_[f];
        const auto& c = facet.corners;
        // Across an edge of the facet lies the neighbour opposite the facet's third corner.
        const auto& place = kFacet[facet.index];
        auto& neighbours = cells_[facet.created].neighbours;
        neighbours[place[2]] = facets_[facetLeftOf_[c[1]][c[0]]].created;
        neighbours[place[0]] = facets_[facetLeftOf_[c[2]][c[1]]].created;
        neighbours[place[1]] = facets_[facetLeftOf_[c[0]][c[2]]].created;
    }
}

// The same for cavities with any number of corners, by turning around each edge through the cavity.
//
// Pre:  placeNewCells ran. Post: all neighbours of the new cells are set; the cells of the cavity are spoilt.
//
// First the facets are turned into doors: where a cell of the cavity pointed to the outer cell, it now points
// to the new cell on that facet, so that a turn through the cavity ends at a new cell.
void BowyerWatson::linkByTurning() {
    for (std::size_t f = 0; f < facetCount_; ++f) {
        const CavityFacet& facet = facets_[f];
        cells_[facet.inner].neighbours[facet.index] = facet.created;
        for (std::uint32_t j = 0; j < 4; ++j) {
            if (j != facet.index) cells_[facet.created].neighbours[j] = kNoCell;
        }
    }
    for (std::size_t f = 0; f < facetCount_; ++f) {
        const CavityFacet& facet = facets_[f];
        for (std::uint32_t j = 0; j < 4; ++j) {
            if (j != facet.index && cells_[facet.created].neighbours[j] == kNoCell) linkAroundEdge(facet, j);
        }
    }
}

// Finds the new cell that shares facet j with the one on `facet`, and makes them neighbours.
//
// Pre: linkByTurning opened the doors; j != facet.index; neither cell has that link yet.
//
// The facet of the cavity and facet j of its inner cell share an edge: the two vertices of the inner cell
// that are neither vertex facet.index nor vertex j. The cells around that edge are visited in turn, leaving
// each through its facet `across`, which has the edge and the vertex `leaving`. The next cell has these three
// and a fourth vertex. We entered it opposite the fourth, so we go out opposite `leaving`, and the fourth
// becomes `leaving`. Exclusive or of all four vertices, the edge and `leaving` gives it.
void BowyerWatson::linkAroundEdge(const CavityFacet& facet, std::uint32_t j) {
    std::uint32_t cell = facet.inner;
    std::uint32_t across = j;
    const std::array<std::uint32_t, 4> own = cells_[cell].corners();
    const std::uint32_t all = own[0] ^ own[1] ^ own[2] ^ own[3];
    std::uint32_t leaving = own[facet.index];
    const std::uint32_t edge = all ^ leaving ^ own[j];
    for (;;) {
        const std::uint32_t next = cells_[cell].neighbours[across];
        const auto& v = cells_[next].vertices;
        if ((v[0] & kInCavity) == 0) {
            // Through a door: `next` is the new cell on facet `across` of `cell`. It has the vertices of
            // `cell` in the same places, except p at `across`. What it shares with ours is the edge and p, so
            // we are its neighbour opposite `leaving`.
            const std::uint32_t back = indexOf(cells_[cell].vertices, leaving);
            cells_[facet.created].neighbours[j] = next;
            cells_[next].neighbours[back] = facet.created;
            return;
        }
        across = indexOf(v, leaving);
        leaving = cells_[next].firstVertex() ^ v[1] ^ v[2] ^ v[3] ^ edge ^ leaving;
        cell = next;
    }
}

// Pre: placeNewCells ran. Post: new cells are linked and have their balls. A large cavity is rare, and its
// cells go without balls: they are judged by the predicates.
template <bool kAllOwned>
void BowyerWatson::linkNewCells(std::uint32_t vertex) {
    if (numberCorners<kAllOwned>(vertex)) {
        linkByTable();
        computeBalls(sites_[vertex]);
    } else {
        linkByTurning();
        for (std::size_t f = 0; f < facetCount_; ++f) {
            cells_.ball(facets_[f].created).squaredRadius = kNoBall;
        }
    }
}

// ---- Step 5: the balls -----------------------------------------------------------------------------------

// Pre: numberCorners returned true. Every corner's offset from p serves some six cells, so it is computed
// once. Cells are handled in pairs, an odd last one with itself. Cells at infinity get no ball; number 0 has
// an offset of zero, so nothing undefined is read.
void BowyerWatson::computeBalls(const Site& p) {
    std::array<Offset, kMaxCorners> offsets;
    for (std::uint32_t i = 1; i < cornerCount_; ++i) offsets[i] = offsetTo(p, sites_[corners_[i]]);
    const auto offsetsOf = [&](const CavityFacet& facet) {
        const auto& c = facet.corners;
        return std::array<const Offset*, 3>{&offsets[c[0]], &offsets[c[1]], &offsets[c[2]]};
    };
    const auto dropIfInfinite = [&](const CavityFacet& facet) {
        const auto& c = facet.corners;
        if (c[0] == 0 || c[1] == 0 || c[2] == 0) cells_.ball(facet.created).squaredRadius = kNoBall;
    };
    for (std::size_t f = 0; f < facetCount_; f += 2) {
        const CavityFacet& first = facets_[f];
        const CavityFacet& second = facets_[std::min(f + 1, facetCount_ - 1)];
        ballsThrough(p, {offsetsOf(first), offsetsOf(second)}, cells_.ball(first.created),
                     cells_.ball(second.created));
        dropIfInfinite(first);
        dropIfInfinite(second);
    }
}

// ---- Steps 3 to 5 ----------------------------------------------------------------------------------------

// Pre:  findCavity returned true.
// Post: if true, the site is a vertex of the triangulation, the cells of the cavity are free, and `hint_` is
//       a new cell. If false, the store is full and the triangulation is unchanged, the cavity still marked.
template <bool kSerial>
bool BowyerWatson::fillCavity(std::uint32_t vertex) {
    if (!takeNewCells()) return false;
    placeNewCells(vertex, cavityMark_);
    if (kSerial || cavityMark_ != 0) {
        linkNewCells<true>(vertex);
    } else {
        markSolelyOwned();
        linkNewCells<false>(vertex);
    }
    for (std::size_t i = 0; i < cavityCount_; ++i) {
        const std::uint32_t cell = cavity_[i];
        cells_[cell].vertices[0] = kFreeCell;
        free_.push_back(cell);
    }
    hint_ = facets_.front().created;
    return true;
}

template bool BowyerWatson::fillCavity<true>(std::uint32_t vertex);
template bool BowyerWatson::fillCavity<false>(std::uint32_t vertex);

}  // namespace shapedb
