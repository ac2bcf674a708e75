#include "core/delaunay/bowyer_watson.h"

#include <algorithm>
#include <utility>

#include "core/base/prefetch.h"

namespace shapedb {

namespace {

// Cells a worker takes from the store at a time.
constexpr std::uint32_t kBatch = 256;

std::uint32_t infiniteIndex(const std::array<std::uint32_t, 4>& v) {
    for (std::uint32_t i = 0; i < 4; ++i) {
        if (v[i] == kInfinite) return i;
    }
    return 4;
}

// Without branches: which it is, is random.
std::uint32_t indexOf(const std::array<std::uint32_t, 4>& v, std::uint32_t vertex) {
    return static_cast<std::uint32_t>(v[1] == vertex) + 2 * static_cast<std::uint32_t>(v[2] == vertex) +
           3 * static_cast<std::uint32_t>(v[3] == vertex);
}

// The search for a cavity waits for memory half of its time: so what it needs next is asked for early.
void fetchNeighbours(const CellStore& cells, std::uint32_t cell) {
    for (const std::uint32_t next : cells[cell].neighbours) {
        prefetch(&cells[next]);
        prefetch(&cells.ball(next));
    }
}

// The facet opposite vertex i, in an order that makes it positive with a point on the side of that
// vertex when appended.
constexpr std::array<std::array<std::uint32_t, 3>, 4> kFacet = {{{2, 1, 3}, {0, 2, 3}, {1, 0, 3}, {0, 1, 2}}};

}  // namespace

void CellStore::reserve(std::size_t capacity) {
    if (capacity <= capacity_) return;
    LargeBlock<Cell> cells = allocateLarge<Cell>(capacity);
    LargeBlock<DelaunayBall> balls = allocateLarge<DelaunayBall>(capacity);
    std::copy_n(cells_.get(), used(), cells.get());
    std::copy_n(balls_.get(), used(), balls.get());
    cells_ = std::move(cells);
    balls_ = std::move(balls);
    capacity_ = capacity;
}

std::uint32_t CellStore::take(std::uint32_t count) {
    const std::size_t first = used_.fetch_add(count, std::memory_order_relaxed);
    if (first + count <= capacity_) return static_cast<std::uint32_t>(first);
    used_.fetch_sub(count, std::memory_order_relaxed);
    return kNoCell;
}

Error notDistinct() { return {ErrorCode::kInternal, "the points to triangulate are not distinct"}; }

BowyerWatson::BowyerWatson(LargeVector<Site>& sites, CellStore& cells, std::uint32_t start)
    : sites_(sites), cells_(cells), hint_(start), cavity_(kMostCorners), facets_(kMostCorners) {
    corners_[0] = kInfinite;
}

BowyerWatson::BowyerWatson(LargeVector<Site>& sites, CellStore& cells, const Ownership& share,
                           const StartCells& starts)
    : BowyerWatson(sites, cells, kNoCell) {
    share_ = share;
    starts_ = &starts;
}

// Almost all of a worker's cells are inner.
template <bool kAlone>
bool BowyerWatson::owns(std::uint32_t cell) const {
    return kAlone || (cells_[cell].vertices[0] & share_.innerMark) != 0 || ownsAtBorder(cell);
}

bool BowyerWatson::ownsAtBorder(std::uint32_t cell) const {
    return share_.holdsThree(cells_[cell].corners());
}

// What the balls leave open.
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

// The cell that holds p, or sees it from outside the hull; kNoCell when it is out of the worker's reach.
template <bool kAlone>
std::uint32_t BowyerWatson::locate(std::uint32_t vertex, const Site& p) const {
    if (kAlone) return walk<kAlone>(hint_, p);
    std::uint32_t found = hint_ != kNoCell ? walk<kAlone>(hint_, p) : kNoCell;
    if (found != kNoCell) return found;
    // What a worker can reach may be in several pieces.
    starts_->visitAround(vertex, [&](std::uint32_t start) {
        if (cells_[start].vertices[0] == kFreeCell || !owns<kAlone>(start)) return false;
        found = walk<kAlone>(start, p);
        return found != kNoCell;
    });
    return found;
}

// Walks towards p through facets that part it from the cell (such a walk ends in a Delaunay
// triangulation), to where p is; kNoCell when the way leaves the worker's reach. Reads neighbours only
// behind facets with two vertices of its own: no other worker changes those.
template <bool kAlone>
std::uint32_t BowyerWatson::walk(std::uint32_t start, const Site& p) const {
    std::uint32_t cell = start;
    const std::uint32_t outside = infiniteIndex(cells_[cell].corners());
    if (outside != 4) cell = cells_[cell].neighbours[outside];
    std::uint32_t from = kNoCell;
    for (;;) {
        const std::array<std::uint32_t, 4> v = cells_[cell].corners();
        if (!isFinite(v)) return cell;
        const bool own = owns<kAlone>(cell);  // then so are two vertices of each facet
        std::uint32_t to = kNoCell;
        bool blocked = false;
        for (std::uint32_t i = 0; i < 4 && to == kNoCell; ++i) {
            const auto& f = kFacet[i];
            const std::uint32_t a = v[f[0]];
            const std::uint32_t b = v[f[1]];
            const std::uint32_t c = v[f[2]];
            const bool open = own || share_.holdsTwo(a, b, c);
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

bool BowyerWatson::isVertexOf(std::uint32_t cell, const Site& p) const {
    for (const std::uint32_t v : cells_[cell].corners()) {
        if (v != kInfinite && samePlace(sites_[v], p)) return true;
    }
    return false;
}

// Bit i: the ball of neighbour i holds p. For neighbours in the cavity already it may say anything.
unsigned BowyerWatson::neighboursHolding(std::uint32_t cell, const Site& p) const {
    const auto& neighbours = cells_[cell].neighbours;
    unsigned holding = 0;
    unsigned open = 0;
    for (std::uint32_t i = 0; i < 4; i += 2) {
        const Held held = ballsHold(cells_.ball(neighbours[i]), cells_.ball(neighbours[i + 1]), p);
        holding |= held.surely << i;
        open |= held.unknown << i;
    }
    for (std::uint32_t i = 0; open != 0 && i < 4; ++i) {
        if ((open >> i & 1u) == 0 || (cells_[neighbours[i]].vertices[0] & kInCavity) != 0) continue;
        if (conflicts(neighbours[i], p)) holding |= 1u << i;
    }
    return holding;
}

// For what one cell can add.
void BowyerWatson::makeRoom() {
    if (cavityCount_ + 4 > cavity_.size()) cavity_.resize(2 * cavity_.size());
    if (facetCount_ + 4 > facets_.size()) facets_.resize(2 * facets_.size());
}

// Collects the cells whose balls hold p, which hang together, and the facets around them. Whether a ball
// holds p is as good as random: so the four neighbours of a cell are judged together and almost without
// branches.
template <bool kAlone>
bool BowyerWatson::findCavity(std::uint32_t first, const Site& p) {
    cavity_[0] = first;
    cavityCount_ = 1;
    facetCount_ = 0;
    const std::uint32_t inner = share_.innerMark;
    std::uint32_t mark = cells_[first].vertices[0] & inner;
    cells_[first].vertices[0] |= kInCavity;
    fetchNeighbours(cells_, first);
    for (std::size_t k = 0; k < cavityCount_; ++k) {
        makeRoom();
        const std::uint32_t cell = cavity_[k];
        const unsigned holding = neighboursHolding(cell, p);
        for (std::uint32_t i = 0; i < 4; ++i) {
            const std::uint32_t next = cells_[cell].neighbours[i];
            const std::uint32_t head = cells_[next].vertices[0];
            const unsigned fresh = (head & kInCavity) == 0 ? 1 : 0;
            const unsigned joins = fresh & (holding >> i);
            cavity_[cavityCount_] = next;
            facets_[facetCount_] = {cell, next, kNoCell, static_cast<std::uint8_t>(i), {}};
            if (joins != 0) {
                if (!kAlone && (head & inner) == 0) {
                    if (!ownsAtBorder(next)) return false;
                    mark = 0;
                }
                cells_[next].vertices[0] = head | kInCavity;
                fetchNeighbours(cells_, next);
            }
            cavityCount_ += joins;
            facetCount_ += fresh & ~joins;
        }
    }
    cavityMark_ = mark;
    return true;
}

void BowyerWatson::unmark() {
    for (std::size_t i = 0; i < cavityCount_; ++i) cells_[cavity_[i]].vertices[0] &= ~kInCavity;
}

// A new cell for every facet.
bool BowyerWatson::takeFresh() {
    while (free_.size() < facetCount_) {
        const std::uint32_t batch = cells_.take(kBatch);
        if (batch == kNoCell) return false;
        for (std::uint32_t i = kBatch; i-- > 0;) {
            cells_[batch + i].vertices[0] = kFreeCell;
            free_.push_back(batch + i);
        }
    }
    for (std::size_t f = 0; f < facetCount_; ++f) {
        Facet& facet = facets_[f];
        facet.fresh = free_.back();
        free_.pop_back();
    }
    return true;
}

// Finds the new cell next to that of `facet` behind its facet j by turning around the edge they share,
// through the cavity.
void BowyerWatson::linkAround(const Facet& facet, std::uint32_t j) {
    std::uint32_t cell = facet.cell;
    std::uint32_t across = j;
    const std::array<std::uint32_t, 4> own = cells_[cell].corners();
    const std::uint32_t all = own[0] ^ own[1] ^ own[2] ^ own[3];
    std::uint32_t leaving = own[facet.index];
    const std::uint32_t edge = all ^ leaving ^ own[j];
    for (;;) {
        const std::uint32_t next = cells_[cell].neighbours[across];
        const auto& v = cells_[next].vertices;
        if ((v[0] & kInCavity) == 0) {
            // `next` is the new cell on facet `across` of `cell`; where `leaving` is, our neighbour is.
            const std::uint32_t back = indexOf(cells_[cell].vertices, leaving);
            cells_[facet.fresh].neighbours[j] = next;
            cells_[next].neighbours[back] = facet.fresh;
            return;
        }
        across = indexOf(v, leaving);
        leaving = cells_[next].firstVertex() ^ v[1] ^ v[2] ^ v[3] ^ edge ^ leaving;
        cell = next;
    }
}

// Writes the new cells, their first vertices with a mark, and joins them to those beyond the cavity.
void BowyerWatson::placeFresh(std::uint32_t vertex, std::uint32_t mark) {
    for (std::size_t f = 0; f < facetCount_; ++f) {
        const Facet& facet = facets_[f];
        Cell& fresh = cells_[facet.fresh];
        fresh.vertices = cells_[facet.cell].corners();
        auto& v = fresh.vertices;
        // Which neighbour of the cell beyond we are shows in its vertices: others may be writing its
        // other neighbours.
        const std::uint32_t shared = v[0] ^ v[1] ^ v[2] ^ v[3] ^ v[facet.index];
        Cell& beyond = cells_[facet.beyond];
        const auto& w = beyond.vertices;
        const std::uint32_t apex = beyond.firstVertex() ^ w[1] ^ w[2] ^ w[3] ^ shared;
        beyond.neighbours[indexOf(w, apex)] = facet.fresh;
        v[facet.index] = vertex;
        v[0] |= mark;
        fresh.neighbours[facet.index] = facet.beyond;
    }
}

// After a cavity some of whose cells are not inner: there may be others among the new ones.
void BowyerWatson::markInner() {
    for (std::size_t f = 0; f < facetCount_; ++f) {
        Cell& fresh = cells_[facets_[f].fresh];
        if (share_.holdsAll(fresh.vertices)) fresh.vertices[0] |= share_.innerMark;
    }
}

// The number of a corner that has one below `count`; kMostCorners for another.
std::uint32_t BowyerWatson::numberAmong(std::uint32_t vertex, std::uint32_t count) const {
    const auto* const begin = corners_.begin();
    const auto* const at = std::find(begin + 1, begin + count, vertex);
    return at == begin + count ? kMostCorners : static_cast<std::uint32_t>(at - begin);
}

// Gives the corners of the cavity numbers; false when there are too many of them. The mark of a site tells
// for which vertex it was numbered last, and how; those of other workers' vertices are theirs to write.
template <bool kOurs>
bool BowyerWatson::numberCorners(std::uint32_t inserted) {
    const std::uint64_t mark = (std::uint64_t{inserted} + 1) * kMostCorners;
    std::uint32_t count = 1;  // 0 is the vertex at infinity
    for (std::size_t f = 0; f < facetCount_; ++f) {
        Facet& facet = facets_[f];
        const auto& v = cells_[facet.cell].vertices;
        for (std::uint32_t k = 0; k < 3; ++k) {
            const std::uint32_t vertex = v[kFacet[facet.index][k]] & kVertexBits;
            if (vertex == kInfinite) {
                facet.corners[k] = 0;
                continue;
            }
            if (count == kMostCorners) return false;
            const bool ours = kOurs || share_.holds(vertex);
            const std::uint64_t known = ours ? sites_[vertex].mark - mark : numberAmong(vertex, count);
            const bool fresh = known >= kMostCorners;
            const std::uint64_t number = fresh ? count : known;
            corners_[count] = vertex;
            if (ours) sites_[vertex].mark = mark + number;
            count += fresh ? 1 : 0;
            facet.corners[k] = static_cast<std::uint8_t>(number);
        }
    }
    cornerCount_ = count;
    return true;
}

// Each edge around the cavity has a facet on its left and, seen backwards, another.
void BowyerWatson::linkByTable() {
    for (std::size_t f = 0; f < facetCount_; ++f) {
        const auto& c = facets_[f].corners;
        const auto at = static_cast<std::uint16_t>(f);
        sides_[c[0]][c[1]] = at;
        sides_[c[1]][c[2]] = at;
        sides_[c[2]][c[0]] = at;
    }
    for (std::size_t f = 0; f < facetCount_; ++f) {
        const Facet& facet = facets_[f];
        const auto& c = facet.corners;
        const auto& position = kFacet[facet.index];
        auto& neighbours = cells_[facet.fresh].neighbours;
        neighbours[position[2]] = facets_[sides_[c[1]][c[0]]].fresh;
        neighbours[position[0]] = facets_[sides_[c[2]][c[1]]].fresh;
        neighbours[position[1]] = facets_[sides_[c[0]][c[2]]].fresh;
    }
}

void BowyerWatson::measureBalls(const Site& p) {
    std::array<Way, kMostCorners> ways;
    for (std::uint32_t i = 1; i < cornerCount_; ++i) ways[i] = wayTo(p, sites_[corners_[i]]);
    const auto waysOf = [&](const Facet& facet) {
        const auto& c = facet.corners;
        return std::array<const Way*, 3>{&ways[c[0]], &ways[c[1]], &ways[c[2]]};
    };
    const auto dropInfinite = [&](const Facet& facet) {
        const auto& c = facet.corners;
        if (c[0] == 0 || c[1] == 0 || c[2] == 0) cells_.ball(facet.fresh).squaredRadius = kNoBall;
    };
    for (std::size_t f = 0; f < facetCount_; f += 2) {
        const Facet& first = facets_[f];
        const Facet& second = facets_[std::min(f + 1, facetCount_ - 1)];  // the same when there is none
        ballsThrough(p, {waysOf(first), waysOf(second)}, cells_.ball(first.fresh), cells_.ball(second.fresh));
        dropInfinite(first);
        dropInfinite(second);
    }
}

// For a cavity of any size.
void BowyerWatson::linkByTurning() {
    for (std::size_t f = 0; f < facetCount_; ++f) {
        const Facet& facet = facets_[f];
        cells_[facet.cell].neighbours[facet.index] = facet.fresh;
        for (std::uint32_t j = 0; j < 4; ++j) {
            if (j != facet.index) cells_[facet.fresh].neighbours[j] = kNoCell;
        }
    }
    for (std::size_t f = 0; f < facetCount_; ++f) {
        const Facet& facet = facets_[f];
        for (std::uint32_t j = 0; j < 4; ++j) {
            if (j != facet.index && cells_[facet.fresh].neighbours[j] == kNoCell) linkAround(facet, j);
        }
    }
}

template <bool kOurs>
void BowyerWatson::joinFresh(std::uint32_t vertex) {
    if (numberCorners<kOurs>(vertex)) {
        linkByTable();
        measureBalls(sites_[vertex]);
    } else {
        linkByTurning();
        for (std::size_t f = 0; f < facetCount_; ++f) cells_.ball(facets_[f].fresh).squaredRadius = kNoBall;
    }
}

template <bool kAlone>
void BowyerWatson::fillCavity(std::uint32_t vertex) {
    placeFresh(vertex, cavityMark_);
    if (kAlone || cavityMark_ != 0) {
        joinFresh<true>(vertex);
    } else {
        markInner();
        joinFresh<false>(vertex);
    }
    for (std::size_t i = 0; i < cavityCount_; ++i) {
        const std::uint32_t cell = cavity_[i];
        cells_[cell].vertices[0] = kFreeCell;
        free_.push_back(cell);
    }
    hint_ = facets_.front().fresh;
}

template <bool kAlone>
Insertion BowyerWatson::insertAs(std::uint32_t vertex) {
    const Site p = sites_[vertex];
    const std::uint32_t first = locate<kAlone>(vertex, p);
    if (first == kNoCell || !owns<kAlone>(first)) return Insertion::kElsewhere;
    if (isVertexOf(first, p)) return Insertion::kRepeated;
    if (!findCavity<kAlone>(first, p)) {
        unmark();
        return Insertion::kElsewhere;
    }
    if (!takeFresh()) {
        unmark();
        return Insertion::kNoRoom;
    }
    fillCavity<kAlone>(vertex);
    return Insertion::kDone;
}

Insertion BowyerWatson::insert(std::uint32_t vertex) {
    return starts_ == nullptr ? insertAs<true>(vertex) : insertAs<false>(vertex);
}

}  // namespace shapedb
