// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/delaunay/flat_delaunay.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <numeric>
#include <utility>

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>

#include "core/base/return_if_error.h"
#include "core/delaunay/parallel_insertion.h"

namespace shapedb {

namespace {

// Cells to reserve for each point. A scan has six or seven; where there are more, the store grows.
constexpr std::size_t kCellsPerPoint = 8;
constexpr std::size_t kSpareCells = 4096;
// Below kNoCell and kFreeCell.
constexpr std::size_t kMaxCells = 0xfffffff0u;

// After each round there are 2^kRoundShift times as many points as before it.
constexpr int kRoundShift = 2;
constexpr std::size_t kSmallestRound = 512;
// What a parallel round leaves goes in parallel again from this fraction (1 in ...) of minPerThread on: its
// points lie far apart, so each of them takes longer.
constexpr std::size_t kPendingFraction = 8;

// Mixes the bits of an index: the finaliser of MurmurHash3.
std::uint32_t hashOf(std::uint32_t i) {
    i ^= i >> 16;
    i *= 0x85ebca6bu;
    i ^= i >> 13;
    i *= 0xc2b2ae35u;
    return i ^ (i >> 16);
}

// A biased randomised insertion order (Amenta, Choi and Rote, "Incremental constructions con BRIO", 2003):
// each site goes to a round at random, by a hash of its number; within a round, sites keep their order. The
// random rounds bound the number of cells made in vain, the order within them keeps walks short and memory
// close. Round k is order[ends[k - 1]] up to, excluding, order[ends[k]].
struct Rounds {
    std::vector<std::uint32_t> order;
    std::vector<std::size_t> ends;
};

Rounds makeRounds(std::size_t count) {
    int rounds = 1;
    while ((count >> (kRoundShift * rounds)) > kSmallestRound) ++rounds;
    const auto roundOf = [&](std::uint32_t i) {
        int round = rounds - 1;
        for (std::uint32_t bits = hashOf(i); round > 0 && (bits & ((1u << kRoundShift) - 1)) == 0; --round) {
            bits >>= kRoundShift;
        }
        return static_cast<std::size_t>(round);
    };
    Rounds made;
    std::vector<std::size_t> next(static_cast<std::size_t>(rounds) + 1, 0);
    for (std::uint32_t i = 0; i < count; ++i) ++next[roundOf(i) + 1];
    std::partial_sum(next.begin(), next.end(), next.begin());
    made.ends.assign(next.begin() + 1, next.end());
    made.order.resize(count);
    for (std::uint32_t i = 0; i < count; ++i) made.order[next[roundOf(i)]++] = i;
    return made;
}

bool onOneLine(const Site& a, const Site& b, const Site& c) {
    using Point = CGAL::Exact_predicates_inexact_constructions_kernel::Point_3;
    return CGAL::collinear(Point(a.x, a.y, a.z), Point(b.x, b.y, b.z), Point(c.x, c.y, c.z));
}

class Builder {
  public:
    Builder(LargeVector<Site>& sites, CellStore& cells, std::size_t threads, const RunContext& context,
            const ParallelLimits& limits)
        : sites_(sites),
          cells_(cells),
          threads_(std::min(threads, ParallelInsertion::kMaxWorkers)),
          context_(context),
          limits_(limits),
          parallel_(sites, cells, threads_, context, done_) {}

    Result<void> build() {
        RETURN_IF_ERROR(context_.checkpoint());
        context_.report("delaunay", 0, sites_.size());
        reserve(kCellsPerPoint * sites_.size() + kSpareCells);
        const Rounds rounds = makeRounds(sites_.size());
        RETURN_IF_ERROR(makeFirstCells(rounds.order));
        std::size_t begin = 0;
        for (const std::size_t end : rounds.ends) {
            std::vector<std::uint32_t> pending(rounds.order.begin() + static_cast<std::ptrdiff_t>(begin),
                                               rounds.order.begin() + static_cast<std::ptrdiff_t>(end));
            dropFirst(pending);
            RETURN_IF_ERROR(insertRound(std::move(pending)));
            begin = end;
        }
        return {};
    }

  private:
    // More cells than indices can tell apart are of no use.
    void reserve(std::size_t cells) { cells_.reserve(std::min(kMaxCells, cells)); }
    void dropFirst(std::vector<std::uint32_t>& list) const {
        const auto taken = [&](std::uint32_t v) {
            return std::find(first_.begin(), first_.end(), v) != first_.end();
        };
        list.erase(std::remove_if(list.begin(), list.end(), taken), list.end());
    }
    Result<void> makeFirstCells(const std::vector<std::uint32_t>& order);
    Result<void> insertRound(std::vector<std::uint32_t> pending);
    Result<void> insertSerially(const std::vector<std::uint32_t>& list);
    Result<void> insertInParallel(std::vector<std::uint32_t>& list);
    std::uint32_t anyCell() const;

    LargeVector<Site>& sites_;
    CellStore& cells_;
    std::size_t threads_;
    const RunContext& context_;
    const ParallelLimits& limits_;
    std::array<std::uint32_t, 4> first_{};
    std::vector<std::uint32_t> free_;  // cells of the store that are not in use
    std::uint32_t last_ = 0;           // a cell in use, where the next walk begins
    std::atomic<std::size_t> done_{0};
    ParallelInsertion parallel_;
};

// Makes the cell of the first four sites that span space, and the four cells at infinity around it.
//
// Post: neighbours are mutual, all five cells are positively oriented and have no ball; `done_` is 4. The
// four sites have to be skipped later.
Result<void> Builder::makeFirstCells(const std::vector<std::uint32_t>& order) {
    const auto site = [&](std::size_t i) -> const Site& { return sites_[order[i]]; };
    std::size_t b = 1;
    while (b < order.size() && samePlace(site(0), site(b))) ++b;
    if (b == order.size()) return fail(ErrorCode::kTooFewPoints, "fewer than 4 distinct points");
    std::size_t c = b + 1;
    while (c < order.size() && onOneLine(site(0), site(b), site(c))) ++c;
    if (c >= order.size()) return fail(ErrorCode::kCollinear, "all points lie on one line");
    std::size_t d = c + 1;
    while (d < order.size() && orientation(site(0), site(b), site(c), site(d)) == 0) ++d;
    if (d >= order.size()) return fail(ErrorCode::kCoplanar, "all points lie in one plane");
    first_ = {order[0], order[b], order[c], order[d]};
    if (orientation(site(0), site(b), site(c), site(d)) < 0) std::swap(first_[0], first_[1]);
    done_ = 4;
    // There is room: kSpareCells.
    const std::uint32_t inner = cells_.take(5);
    for (std::uint32_t i = 0; i < 5; ++i) cells_.ball(inner + i).squaredRadius = kNoBall;
    cells_[inner] = {first_, {inner + 1, inner + 2, inner + 3, inner + 4}};
    for (std::uint32_t i = 0; i < 4; ++i) {
        // The inner cell, with the vertex at infinity instead of vertex i. That lies on the other side of
        // facet i, so two of the other vertices are swapped to keep the orientation positive.
        Cell& outer = cells_[inner + 1 + i];
        outer.vertices = first_;
        outer.vertices[i] = kInfinite;
        const std::uint32_t p = (i + 1) % 4;
        const std::uint32_t q = (i + 2) % 4;
        std::swap(outer.vertices[p], outer.vertices[q]);
        // Opposite infinity lies the inner cell, opposite another vertex the outer cell that lacks it.
        for (std::uint32_t k = 0; k < 4; ++k) {
            const std::uint32_t facet = k == p ? q : k == q ? p : k;
            outer.neighbours[k] = k == i ? inner : inner + 1 + facet;
        }
    }
    last_ = inner;
    return {};
}

Result<void> Builder::insertRound(std::vector<std::uint32_t> pending) {
    const std::size_t least = threads_ * limits_.minPerThread;
    if (threads_ > 1 && sites_.size() >= limits_.minPoints && pending.size() >= least) {
        RETURN_IF_ERROR(insertInParallel(pending));
    }
    return insertSerially(pending);
}

Result<void> Builder::insertSerially(const std::vector<std::uint32_t>& list) {
    BowyerWatson inserter(sites_, cells_, last_);
    inserter.freeCells().swap(free_);
    for (std::size_t i = 0; i < list.size(); ++i, ++done_) {
        if (i % kInsertsBetweenCheckpoints == 0) {
            RETURN_IF_ERROR(context_.checkpoint());
            context_.report("delaunay", done_, sites_.size());
        }
        Insertion outcome = inserter.insert(list[i]);
        while (outcome == Insertion::kStoreFull) {
            if (cells_.capacity() >= kMaxCells) {
                return fail(ErrorCode::kOutOfMemory,
                            "the Delaunay triangulation needs more than 4e9 tetrahedra");
            }
            // By half, so that all copying together is linear.
            reserve(cells_.capacity() + cells_.capacity() / 2);
            outcome = inserter.insert(list[i]);
        }
        if (outcome != Insertion::kInserted) return fail(duplicatePointsError());
    }
    free_.swap(inserter.freeCells());
    last_ = inserter.lastCell();
    return {};
}

// The first cell in use.
std::uint32_t Builder::anyCell() const {
    std::uint32_t cell = 0;
    while (cells_[cell].isFree()) ++cell;
    return cell;
}

// Inserts what the workers can insert independently of each other; the rest stays in `list`.
Result<void> Builder::insertInParallel(std::vector<std::uint32_t>& list) {
    // Workers cannot grow the store, because that moves the cells from under the others.
    reserve(cells_.used() + kCellsPerPoint * list.size() + kSpareCells);
    RETURN_IF_ERROR(parallel_.insert(list, free_));
    for (int side = 0; side < 2 && list.size() >= threads_ * limits_.minPerThread / kPendingFraction;
         ++side) {
        RETURN_IF_ERROR(parallel_.insertPending(list, free_));
    }
    // The cell of the last walk may be gone.
    last_ = anyCell();
    return {};
}

}  // namespace

Result<void> buildTriangulation(LargeVector<Site>& sites, CellStore& cells, std::size_t threads,
                                const RunContext& context, const ParallelLimits& limits) {
    return Builder(sites, cells, threads, context, limits).build();
}

}  // namespace shapedb
