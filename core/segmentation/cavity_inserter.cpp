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

bool isInfinite(const std::array<std::uint32_t, 4>& v) {
    return (static_cast<unsigned>((v[0] & kVertexBits) == kInfinite) |
            static_cast<unsigned>(v[1] == kInfinite) | static_cast<unsigned>(v[2] == kInfinite) |
            static_cast<unsigned>(v[3] == kInfinite)) != 0;
}

// Without branches: which it is, is random.
std::uint32_t indexOf(const std::array<std::uint32_t, 4>& v, std::uint32_t vertex) {
    return static_cast<std::uint32_t>(v[1] == vertex) + 2 * static_cast<std::uint32_t>(v[2] == vertex) +
           3 * static_cast<std::uint32_t>(v[3] == vertex);
}

// The search for a cavity waits for memory half of its time: so what it needs next is asked for early.
void fetchNeighbours(const CellStore& cells, std::uint32_t cell) {
#if defined(__GNUC__)
    for (const std::uint32_t next : cells[cell].neighbours) __builtin_prefetch(&cells[next]);
#else
    static_cast<void>(cells);
    static_cast<void>(cell);
#endif
}

// The one corner of each neighbour that the cell itself does not have.
void fetchApexes(const std::vector<Site>& sites, const CellStore& cells, std::uint32_t cell) {
#if defined(__GNUC__)
    const auto& v = cells[cell].vertices;
    const std::uint32_t all = v[0] ^ v[1] ^ v[2] ^ v[3];
    for (std::size_t i = 0; i < 4; ++i) {
        const auto& w = cells[cells[cell].neighbours[i]].vertices;
        const std::uint32_t apex = (all ^ v[i] ^ w[0] ^ w[1] ^ w[2] ^ w[3]) & kVertexBits;
        __builtin_prefetch(sites.data() + std::min<std::size_t>(apex, sites.size() - 1));
    }
#else
    static_cast<void>(sites);
    static_cast<void>(cells);
    static_cast<void>(cell);
#endif
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

CavityInserter::CavityInserter(std::vector<Site>& sites, CellStore& cells, const VertexRange& range,
                               std::uint32_t start)
    : sites_(sites),
      cells_(cells),
      range_(range),
      alone_(range.begin == 0 && range.end == kInfinite),
      hint_(start) {
    corners_[0] = kInfinite;
}

bool CavityInserter::owns(std::uint32_t cell) const {
    if (alone_) return true;
    const auto& v = cells_[cell].vertices;
    return range_.holds(v[0] & kVertexBits) && range_.holds(v[1]) && range_.holds(v[2]) && range_.holds(v[3]);
}

bool CavityInserter::conflicts(std::uint32_t cell, const Site& p) const {
    const auto& v = cells_[cell].vertices;
    const std::array<std::uint32_t, 4> w = {v[0] & kVertexBits, v[1], v[2], v[3]};
    if (!isInfinite(w)) return sideOfSphere(sites_[w[0]], sites_[w[1]], sites_[w[2]], sites_[w[3]], p) > 0;
    const auto& f = kFacet[infiniteIndex(w)];
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
        if (isInfinite(v)) return cell;
        std::uint32_t to = kNoCell;
        bool blocked = false;
        for (std::uint32_t i = 0; i < 4 && to == kNoCell; ++i) {
            const auto& f = kFacet[i];
            const std::uint32_t a = v[f[0]];
            const std::uint32_t b = v[f[1]];
            const std::uint32_t c = v[f[2]];
            const bool open = alone_ || range_.holds(a) || range_.holds(b) || range_.holds(c);
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
    fetchNeighbours(cells_, first);
    for (std::size_t k = 0; k < cavity_.size(); ++k) {
        const std::uint32_t cell = cavity_[k];
        fetchApexes(sites_, cells_, cell);
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
                    fetchNeighbours(cells_, next);
                    continue;
                }
                if (ours) {
                    cells_[next].vertices[0] |= kAroundCavity;
                    around_.push_back(next);
                }
            }
            facets_.push_back({cell, next, kNoCell, static_cast<std::uint8_t>(i), {}});
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

// Writes the new cells and joins them to those beyond the cavity.
void CavityInserter::placeFresh(std::uint32_t vertex) {
    for (const Facet& facet : facets_) {
        const auto& old = cells_[facet.cell].vertices;
        Cell& fresh = cells_[facet.fresh];
        fresh.vertices = {old[0] & kVertexBits, old[1], old[2], old[3]};
        auto& v = fresh.vertices;
        // Which neighbour of the cell beyond we are shows in its vertices: others may be writing its
        // other neighbours.
        const std::uint32_t shared = v[0] ^ v[1] ^ v[2] ^ v[3] ^ v[facet.index];
        Cell& beyond = cells_[facet.beyond];
        const auto& w = beyond.vertices;
        const std::uint32_t apex = (w[0] & kVertexBits) ^ w[1] ^ w[2] ^ w[3] ^ shared;
        beyond.neighbours[indexOf(w, apex)] = facet.fresh;
        v[facet.index] = vertex;
        fresh.neighbours[facet.index] = facet.beyond;
    }
}

// Gives the corners of the cavity numbers; false when there are too many of them.
bool CavityInserter::numberCorners() {
    std::uint32_t count = 1;  // 0 is the vertex at infinity
    for (Facet& facet : facets_) {
        const auto& v = cells_[facet.cell].vertices;
        for (std::uint32_t k = 0; k < 3; ++k) {
            const std::uint32_t vertex = v[kFacet[facet.index][k]] & kVertexBits;
            if (vertex == kInfinite) {
                facet.corners[k] = 0;
                continue;
            }
            if (count == kMostCorners) return false;
            // A number counts only if it leads back to the vertex.
            const std::uint32_t known = sites_[vertex].number;
            const bool fresh = known >= count || corners_[known] != vertex;
            corners_[count] = vertex;
            const std::uint32_t number = fresh ? count : known;
            sites_[vertex].number = number;
            count += fresh ? 1 : 0;
            facet.corners[k] = static_cast<std::uint8_t>(number);
        }
    }
    return true;
}

// Each edge around the cavity has a facet on its left and, seen backwards, another.
void CavityInserter::linkByTable() {
    for (std::size_t f = 0; f < facets_.size(); ++f) {
        const auto& c = facets_[f].corners;
        const auto at = static_cast<std::uint16_t>(f);
        sides_[c[0]][c[1]] = at;
        sides_[c[1]][c[2]] = at;
        sides_[c[2]][c[0]] = at;
    }
    for (const Facet& facet : facets_) {
        const auto& c = facet.corners;
        const auto& position = kFacet[facet.index];
        auto& neighbours = cells_[facet.fresh].neighbours;
        neighbours[position[2]] = facets_[sides_[c[1]][c[0]]].fresh;
        neighbours[position[0]] = facets_[sides_[c[2]][c[1]]].fresh;
        neighbours[position[1]] = facets_[sides_[c[0]][c[2]]].fresh;
    }
}

// For a cavity of any size.
void CavityInserter::linkByTurning() {
    for (const Facet& facet : facets_) {
        cells_[facet.cell].neighbours[facet.index] = facet.fresh;
        for (std::uint32_t j = 0; j < 4; ++j) {
            if (j != facet.index) cells_[facet.fresh].neighbours[j] = kNoCell;
        }
    }
    for (const Facet& facet : facets_) {
        for (std::uint32_t j = 0; j < 4; ++j) {
            if (j != facet.index && cells_[facet.fresh].neighbours[j] == kNoCell) linkAround(facet, j);
        }
    }
}

void CavityInserter::fillCavity(std::uint32_t vertex) {
    placeFresh(vertex);
    if (numberCorners()) {
        linkByTable();
    } else {
        linkByTurning();
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
