// SPDX-License-Identifier: GPL-3.0-or-later
// A parallel round has three phases. Only the second inserts.
//
//   1. Alone: choose slabs, write down which worker owns each site (and thereby each cell), mark the cells
//      whose vertices all have one owner, collect start cells.
//   2. Side by side: each worker runs through the whole list and inserts its own sites. Ownership does not
//      change in this phase; ownership.h says why workers do not disturb each other.
//   3. Alone: gather what the workers postponed and the cells they no longer use.
//
// The end of the parallel loop orders the memory accesses of phases 2 and 3. Nothing else is needed: within
// phase 2, no memory written by one worker is touched by another, apart from two relaxed atomic counters.
#include "core/delaunay/parallel_insertion.h"

#include <algorithm>
#include <chrono>
#include <numeric>
#include <optional>
#include <thread>

#include "core/base/parallel.h"
#include "core/base/return_if_error.h"
#include "core/geometry/axis.h"

namespace shapedb {

namespace {

// About how many sites are looked at to place the borders of slabs.
constexpr std::size_t kSample = 4096;
constexpr std::size_t kBlock = 8192;  // sites or cells that a thread handles at a time

}  // namespace

// What one worker needs and leaves behind.
struct ParallelInsertion::Worker {
    Ownership ownership;
    StartCells starts;
    std::vector<std::uint32_t> postponed;
    std::vector<std::uint32_t> freeCells;
    std::optional<Error> error;
    double seconds = 0.0;  // that it took
};

// ---- Phase 1: who owns what ------------------------------------------------------------------------------

// Slabs with equal numbers of sites of the list, across the axis along which these extend farthest, among
// those not cut yet: the longer the axis, the smaller the borders.
ParallelInsertion::Slabs ParallelInsertion::makeSlabs(const std::vector<std::uint32_t>& list) const {
    const std::size_t step = std::max<std::size_t>(1, list.size() / kSample);
    Slabs slabs;
    double longest = -1.0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
        if (isCut_[axis]) continue;
        std::vector<double> along;
        for (std::size_t i = 0; i < list.size(); i += step) {
            along.push_back(coordinate(sites_[list[i]], axis));
        }
        std::sort(along.begin(), along.end());
        const double length = along.back() - along.front();
        if (length <= longest) continue;
        longest = length;
        slabs.axis = axis;
        slabs.sample.swap(along);
    }
    for (std::size_t k = 0; k <= workers_; ++k) {
        slabs.borders.push_back(static_cast<double>(k) / static_cast<double>(workers_));
    }
    return slabs;
}

// Post: workerOf_ has the slab of each site, those inserted already included: their cells need owners.
Result<void> ParallelInsertion::assignOwners(const Slabs& slabs) {
    isCut_[slabs.axis] = true;
    const auto last = static_cast<double>(slabs.sample.size() - 1);
    std::vector<double> at;
    for (std::size_t k = 1; k < workers_; ++k) {
        at.push_back(slabs.sample[static_cast<std::size_t>(slabs.borders[k] * last)]);
    }
    workerOf_.resize(sites_.size());
    return parallelFor(workerOf_.size(), kBlock, context_, [&](std::size_t from, std::size_t to) {
        for (std::size_t i = from; i < to; ++i) {
            const double place = coordinate(sites_[i], slabs.axis);
            workerOf_[i] =
                static_cast<std::uint8_t>(std::upper_bound(at.begin(), at.end(), place) - at.begin());
        }
    });
}

// Pre: assignOwners. Post: a cell in use has kSoleOwner exactly if one worker owns all its vertices; marks of
// earlier rounds are gone.
Result<void> ParallelInsertion::markSolelyOwned() {
    return parallelFor(cells_.used(), kBlock, context_, [&](std::size_t from, std::size_t to) {
        for (std::size_t c = from; c < to; ++c) {
            Cell& cell = cells_[static_cast<std::uint32_t>(c)];
            if (cell.isFree()) continue;
            const auto v = cell.corners();
            const bool solely =
                v[0] != kInfinite && Ownership{workerOf_.data(), workerOf_[v[0]], kSoleOwner}.ownsAllOf(v);
            cell.vertices[0] = v[0] | (solely ? kSoleOwner : 0);
        }
    });
}

// Gives each worker its start cells, from an even sample of the store: about four cells for each slot, of
// which the last stays.
// Pre: assignOwners. Post: every start cell is in use and owned by its worker.
void ParallelInsertion::addStarts(std::vector<Worker>& workers) const {
    const std::size_t step = std::max<std::size_t>(1, cells_.used() / (4 * StartCells::kSlots));
    for (std::size_t c = 0; c < cells_.used(); c += step) {
        const auto cell = static_cast<std::uint32_t>(c);
        if (cells_[cell].isFree()) continue;
        const auto v = cells_[cell].corners();
        for (Worker& worker : workers) {
            if (worker.ownership.ownsCell(v)) worker.starts.add(v[0] < kInfinite ? v[0] : v[1], cell);
        }
    }
}

// Moves the borders for the next round, half of the way to where all workers would have taken equally long if
// each had needed the same time everywhere in its slab. Half, because some of the difference is chance.
void ParallelInsertion::moveBorders(const std::vector<double>& seconds) {
    const double all = std::accumulate(seconds.begin(), seconds.end(), 0.0);
    const std::vector<double> before = slabs_.borders;
    double passed = 0.0;
    std::size_t next = 1;
    for (std::size_t k = 0; k < workers_; ++k) {
        for (; next < workers_; ++next) {
            const double wanted = all * static_cast<double>(next) / static_cast<double>(workers_) - passed;
            if (wanted > seconds[k]) break;
            const double share = seconds[k] > 0.0 ? wanted / seconds[k] : 0.0;
            slabs_.borders[next] = (before[next] + before[k] + share * (before[k + 1] - before[k])) / 2;
        }
        passed += seconds[k];
    }
}

// ---- Phase 2: inserting ----------------------------------------------------------------------------------

// One worker's turn through the list. A site that cannot go in now, because others may be at work there or
// because the store is full, is postponed.
void ParallelInsertion::work(const std::vector<std::uint32_t>& list, Worker& worker, bool reports) {
    const auto begun = std::chrono::steady_clock::now();
    BowyerWatson inserter(sites_, cells_, worker.ownership, worker.starts);
    inserter.freeCells().swap(worker.freeCells);
    std::size_t count = 0;
    for (const std::uint32_t vertex : list) {
        if (!worker.ownership.ownsVertex(vertex)) continue;
        if (++count % kInsertsBetweenCheckpoints == 0) {
            done_ += kInsertsBetweenCheckpoints;
            if (auto go = context_.checkpoint(); !go) {
                // The free cells are not handed back, for after an error the triangulation is of no use.
                worker.error = go.error();
                return;
            }
            if (reports) context_.report("delaunay", done_, sites_.size());
        }
        switch (inserter.insert(vertex)) {
            case Insertion::kInserted: break;
            case Insertion::kDuplicate: worker.error = duplicatePointsError(); return;
            case Insertion::kNotOwned:
            case Insertion::kStoreFull: worker.postponed.push_back(vertex); break;
        }
    }
    worker.freeCells.swap(inserter.freeCells());
    worker.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
}

// Pre:  assignOwners; cells carry kSoleOwner if `soleOwnerMark` says so.
// Post: `list` has the sites not inserted, ascending; returns the seconds each worker took.
Result<std::vector<double>> ParallelInsertion::runWorkers(std::vector<std::uint32_t>& list,
                                                          std::uint32_t soleOwnerMark,
                                                          std::vector<std::uint32_t>& freeCells) {
    std::vector<Worker> workers;
    for (std::size_t k = 0; k < workers_; ++k) {
        const Ownership ownership{workerOf_.data(), static_cast<std::uint8_t>(k), soleOwnerMark};
        workers.push_back({ownership, StartCells(sites_.size()), {}, {}, {}, 0.0});
    }
    addStarts(workers);
    workers.front().freeCells.swap(freeCells);
    // Progress may only be reported from the thread that called us.
    const std::thread::id reporter = std::this_thread::get_id();
    auto done = parallelFor(workers_, 1, context_, [&](std::size_t k, std::size_t) {
        work(list, workers[k], std::this_thread::get_id() == reporter);
    });
    RETURN_IF_ERROR(done);
    // Phase 3.
    list.clear();
    std::vector<double> seconds;
    for (const Worker& worker : workers) {
        if (worker.error) return fail(*worker.error);
        list.insert(list.end(), worker.postponed.begin(), worker.postponed.end());
        freeCells.insert(freeCells.end(), worker.freeCells.begin(), worker.freeCells.end());
        seconds.push_back(worker.seconds);
    }
    std::sort(list.begin(), list.end());
    return seconds;
}

// ---- A round ---------------------------------------------------------------------------------------------

Result<void> ParallelInsertion::insert(std::vector<std::uint32_t>& list,
                                       std::vector<std::uint32_t>& freeCells) {
    isCut_ = {};
    if (slabs_.sample.empty()) slabs_ = makeSlabs(list);
    RETURN_IF_ERROR(assignOwners(slabs_));
    RETURN_IF_ERROR(markSolelyOwned());
    const auto seconds = runWorkers(list, kSoleOwner, freeCells);
    RETURN_IF_ERROR(seconds);
    moveBorders(*seconds);
    return {};
}

// So few sites that marking, which visits all cells, would take longer than it saves.
Result<void> ParallelInsertion::insertPending(std::vector<std::uint32_t>& list,
                                              std::vector<std::uint32_t>& freeCells) {
    if (list.empty()) return {};
    RETURN_IF_ERROR(assignOwners(makeSlabs(list)));
    RETURN_IF_ERROR(runWorkers(list, 0, freeCells));
    return {};
}

}  // namespace shapedb
