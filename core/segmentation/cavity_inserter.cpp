#include "core/segmentation/cavity_inserter.h"

#include <algorithm>

namespace shapedb {

namespace {

// Cells a worker takes from the store at a time.
constexpr std::uint32_t kBatch = 256;

std::uint32_t infiniteIndex(const std::array<std::uint32_t, 4>& v) {
    for (std::uint32_t i = 0; i < 4; ++i) {
        if ((v[i] & kVertexBits) == kInfinite) return i;
    }
    return 4;
}

std::uint32_t indexOf(const std::array<std::uint32_t, 4>& v, std::uint32_t vertex) {
    if ((v[0] & kVertexBits) == vertex) return 0;
    return v[1] == vertex ? 1 : v[2] == vertex ? 2 : 3;
}

// The facet opposite vertex i, in an order that makes it positive with a point on the side of that
// vertex when appended.
constexpr std::array<std::array<std::uint32_t, 3>, 4> kFacet = {{{2, 1, 3}, {0, 2, 3}, {1, 0, 3}, {0, 1, 2}}};

}  // namespace

void CellStore::reserve(std::size_t capacity) {
    if (capacity <= capacity_) return;
    // Not make_unique: it would write, and so touch, every page.
    std::unique_ptr<Cell[]> grown(new Cell[capacity]);
    std::copy_n(cells_.get(), used(), grown.get());
    cells_ = std::move(grown);
    capacity_ = capacity;
}

std::uint32_t CellStore::take(std::uint32_t count) {
    const std::size_t first = used_.fetch_add(count, std::memory_order_relaxed);
    if (first + count <= capacity_) return static_cast<std::uint32_t>(first);
    used_.fetch_sub(count, std::memory_order_relaxed);
    return kNoCell;
}

CavityInserter::CavityInserter(const std::vector<Site>& sites, CellStore& cells, const VertexRange& range,
                               std::uint32_t start)
    : sites_(sites), cells_(cells), range_(range), hint_(start) {}

bool CavityInserter::owns(std::uint32_t cell) const {
    const auto& v = cells_[cell].vertices;
    return range_.holds(v[0] & kVertexBits) && range_.holds(v[1]) && range_.holds(v[2]) && range_.holds(v[3]);
}

bool CavityInserter::conflicts(std::uint32_t cell, const Site& p) const {
    const auto& v = cells_[cell].vertices;
    const std::array<std::uint32_t, 4> w = {v[0] & kVertexBits, v[1], v[2], v[3]};
    const std::uint32_t infinite = infiniteIndex(w);
    if (infinite == 4) return sideOfSphere(sites_[w[0]], sites_[w[1]], sites_[w[2]], sites_[w[3]], p) > 0;
    const auto& f = kFacet[infinite];
    const Site& a = sites_[w[f[0]]];
    const Site& b = sites_[w[f[1]]];
    const Site& c = sites_[w[f[2]]];
    const int side = orientation(a, b, c, p);
    return side != 0 ? side > 0 : sideOfCircle(a, b, c, p) > 0;
}

// Walks towards p through facets that part it from the cell (such a walk ends in a Delaunay
// triangulation). Returns the cell that holds p, or sees it from outside the hull; kNoCell when the way
// leaves the worker's reach. Reads neighbours only behind facets with a vertex of its own: no other
// worker changes those.
std::uint32_t CavityInserter::locate(const Site& p) const {
    std::uint32_t cell = hint_;
    const std::uint32_t outside = infiniteIndex(cells_[cell].vertices);
    if (outside != 4) cell = cells_[cell].neighbours[outside];
    std::uint32_t from = kNoCell;
    for (;;) {
        const auto& v = cells_[cell].vertices;
        if (infiniteIndex(v) != 4) return cell;
        std::uint32_t to = kNoCell;
        bool blocked = false;
        for (std::uint32_t i = 0; i < 4 && to == kNoCell; ++i) {
            const auto& f = kFacet[i];
            const std::uint32_t a = v[f[0]];
            const std::uint32_t b = v[f[1]];
            const std::uint32_t c = v[f[2]];
            const bool open = range_.holds(a) || range_.holds(b) || range_.holds(c);
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

bool CavityInserter::isVertexOf(std::uint32_t cell, const Site& p) const {
    for (const std::uint32_t v : cells_[cell].vertices) {
        if (v != kInfinite && samePlace(sites_[v], p)) return true;
    }
    return false;
}

// Collects the cells whose balls hold p, which hang together, and the facets around them.
bool CavityInserter::findCavity(std::uint32_t first, const Site& p) {
    cavity_.clear();
    around_.clear();
    facets_.clear();
    cavity_.push_back(first);
    cells_[first].vertices[0] |= kInCavity;
    for (std::size_t k = 0; k < cavity_.size(); ++k) {
        const std::uint32_t cell = cavity_[k];
        for (std::uint32_t i = 0; i < 4; ++i) {
            const std::uint32_t next = cells_[cell].neighbours[i];
            const std::uint32_t marks = cells_[next].vertices[0];
            if ((marks & kInCavity) != 0) continue;
            if ((marks & kAroundCavity) == 0) {
                const bool ours = owns(next);
                if (conflicts(next, p)) {
                    if (!ours) return false;
                    cells_[next].vertices[0] |= kInCavity;
                    cavity_.push_back(next);
                    continue;
                }
                if (ours) {
                    cells_[next].vertices[0] |= kAroundCavity;
                    around_.push_back(next);
                }
            }
            facets_.push_back({cell, i, kNoCell});
        }
    }
    return true;
}

void CavityInserter::unmark() {
    for (const std::uint32_t cell : cavity_) cells_[cell].vertices[0] &= kVertexBits;
    for (const std::uint32_t cell : around_) cells_[cell].vertices[0] &= kVertexBits;
}

// A new cell for every facet.
bool CavityInserter::takeFresh() {
    while (free_.size() < facets_.size()) {
        const std::uint32_t batch = cells_.take(kBatch);
        if (batch == kNoCell) return false;
        for (std::uint32_t i = kBatch; i-- > 0;) {
            cells_[batch + i].vertices[0] = kFreeCell;
            free_.push_back(batch + i);
        }
    }
    for (Facet& facet : facets_) {
        facet.fresh = free_.back();
        free_.pop_back();
    }
    return true;
}

// Finds the new cell next to that of `facet` behind its facet j by turning around the edge they share,
// through the cavity.
void CavityInserter::linkAround(const Facet& facet, std::uint32_t j) {
    std::uint32_t cell = facet.cell;
    std::uint32_t across = j;
    const auto& own = cells_[cell].vertices;
    const std::uint32_t all = (own[0] & kVertexBits) ^ own[1] ^ own[2] ^ own[3];
    std::uint32_t leaving = facet.index == 0 ? own[0] & kVertexBits : own[facet.index];
    const std::uint32_t edge = all ^ leaving ^ (j == 0 ? own[0] & kVertexBits : own[j]);
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
        leaving = (v[0] & kVertexBits) ^ v[1] ^ v[2] ^ v[3] ^ edge ^ leaving;
        cell = next;
    }
}

void CavityInserter::fillCavity(std::uint32_t vertex) {
    for (const Facet& facet : facets_) {
        Cell& old = cells_[facet.cell];
        Cell& fresh = cells_[facet.fresh];
        fresh.vertices = old.vertices;
        fresh.vertices[0] &= kVertexBits;
        fresh.neighbours = {kNoCell, kNoCell, kNoCell, kNoCell};
        const std::uint32_t beyond = old.neighbours[facet.index];
        // Which neighbour of the cell beyond we are shows in its vertices: others may be writing its
        // other neighbours.
        const auto& v = fresh.vertices;
        auto& w = cells_[beyond].vertices;
        const std::uint32_t shared = v[0] ^ v[1] ^ v[2] ^ v[3] ^ v[facet.index];
        const std::uint32_t apex = (w[0] & kVertexBits) ^ w[1] ^ w[2] ^ w[3] ^ shared;
        cells_[beyond].neighbours[indexOf(w, apex)] = facet.fresh;
        fresh.neighbours[facet.index] = beyond;
        fresh.vertices[facet.index] = vertex;
        old.neighbours[facet.index] = facet.fresh;
    }
    for (const Facet& facet : facets_) {
        for (std::uint32_t j = 0; j < 4; ++j) {
            if (j != facet.index && cells_[facet.fresh].neighbours[j] == kNoCell) linkAround(facet, j);
        }
    }
    for (const std::uint32_t cell : around_) cells_[cell].vertices[0] &= kVertexBits;
    for (const std::uint32_t cell : cavity_) {
        cells_[cell].vertices[0] = kFreeCell;
        free_.push_back(cell);
    }
    hint_ = facets_.front().fresh;
}

Insertion CavityInserter::insert(std::uint32_t vertex) {
    const Site p = sites_[vertex];
    const std::uint32_t first = locate(p);
    if (first == kNoCell || !owns(first)) return Insertion::kElsewhere;
    if (isVertexOf(first, p)) return Insertion::kRepeated;
    if (!findCavity(first, p)) {
        unmark();
        return Insertion::kElsewhere;
    }
    if (!takeFresh()) {
        unmark();
        return Insertion::kNoRoom;
    }
    fillCavity(vertex);
    return Insertion::kDone;
}

}  // namespace shapedb
