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

// So many sites tell where slabs with as many points as others end.
constexpr std::size_t kSample = 4096;
constexpr std::size_t kBlock = 8192;  // sites or cells that a thread takes at a time

}  // namespace

// What one worker needs and leaves.
struct ParallelInsertion::Worker {
    Ownership share;
    StartCells starts;
    std::vector<std::uint32_t> postponed;
    std::vector<std::uint32_t> freeCells;
    std::optional<Error> error;
    double seconds = 0.0;  // it took
};

// As many sites of the list in each, across its longest side that was not cut.
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

Result<void> ParallelInsertion::cut(const Slabs& slabs) {
    isCut_[slabs.axis] = true;
    const auto last = static_cast<double>(slabs.sample.size() - 1);
    std::vector<double> at;
    for (std::size_t k = 1; k < workers_; ++k) {
        at.push_back(slabs.sample[static_cast<std::size_t>(slabs.borders[k] * last)]);
    }
    slabOf_.resize(sites_.size());
    return parallelFor(slabOf_.size(), kBlock, context_, [&](std::size_t from, std::size_t to) {
        for (std::size_t i = from; i < to; ++i) {
            const double place = coordinate(sites_[i], slabs.axis);
            slabOf_[i] =
                static_cast<std::uint8_t>(std::upper_bound(at.begin(), at.end(), place) - at.begin());
        }
    });
}

Result<void> ParallelInsertion::markInner() {
    return parallelFor(cells_.used(), kBlock, context_, [&](std::size_t from, std::size_t to) {
        for (std::size_t c = from; c < to; ++c) {
            Cell& cell = cells_[static_cast<std::uint32_t>(c)];
            if (cell.vertices[0] == kFreeCell) continue;
            const auto v = cell.corners();
            const bool inner =
                v[0] != kInfinite && Ownership{slabOf_.data(), slabOf_[v[0]], kInner}.holdsAll(v);
            cell.vertices[0] = v[0] | (inner ? kInner : 0);
        }
    });
}

// Half of the way to where all would have taken as long, had each needed the same time everywhere in its
// slab: the other half is taken for chance.
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

Result<void> ParallelInsertion::insert(std::vector<std::uint32_t>& list,
                                       std::vector<std::uint32_t>& freeCells) {
    isCut_ = {};
    if (slabs_.sample.empty()) slabs_ = makeSlabs(list);
    RETURN_IF_ERROR(cut(slabs_));
    RETURN_IF_ERROR(markInner());
    const auto seconds = insertSideBySide(list, kInner, freeCells);
    RETURN_IF_ERROR(seconds);
    moveBorders(*seconds);
    return {};
}

// So few points that marks, which take a look at all cells, are not worth it.
Result<void> ParallelInsertion::insertLeft(std::vector<std::uint32_t>& list,
                                           std::vector<std::uint32_t>& freeCells) {
    if (list.empty()) return {};
    RETURN_IF_ERROR(cut(makeSlabs(list)));
    RETURN_IF_ERROR(insertSideBySide(list, 0, freeCells));
    return {};
}

// Returns the seconds each worker took.
Result<std::vector<double>> ParallelInsertion::insertSideBySide(std::vector<std::uint32_t>& list,
                                                                std::uint32_t innerMark,
                                                                std::vector<std::uint32_t>& freeCells) {
    std::vector<Worker> workers;
    for (std::size_t k = 0; k < workers_; ++k) {
        const Ownership share{slabOf_.data(), static_cast<std::uint8_t>(k), innerMark};
        workers.push_back({share, StartCells(sites_.size()), {}, {}, {}, 0.0});
    }
    addStarts(workers);
    workers.front().freeCells.swap(freeCells);
    const std::thread::id reporter = std::this_thread::get_id();
    auto done = parallelFor(workers_, 1, context_, [&](std::size_t k, std::size_t) {
        work(list, workers[k], std::this_thread::get_id() == reporter);
    });
    RETURN_IF_ERROR(done);
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

// A few for each slot.
void ParallelInsertion::addStarts(std::vector<Worker>& workers) const {
    const std::size_t step = std::max<std::size_t>(1, cells_.used() / (4 * StartCells::kSlots));
    for (std::size_t c = 0; c < cells_.used(); c += step) {
        const auto cell = static_cast<std::uint32_t>(c);
        if (cells_[cell].vertices[0] == kFreeCell) continue;
        const auto v = cells_[cell].corners();
        for (Worker& worker : workers) {
            if (worker.share.holdsThree(v)) worker.starts.add(v[0] < kInfinite ? v[0] : v[1], cell);
        }
    }
}

void ParallelInsertion::work(const std::vector<std::uint32_t>& list, Worker& worker, bool reports) {
    const auto begun = std::chrono::steady_clock::now();
    BowyerWatson inserter(sites_, cells_, worker.share, worker.starts);
    inserter.freeCells().swap(worker.freeCells);
    std::size_t count = 0;
    for (const std::uint32_t vertex : list) {
        if (!worker.share.holds(vertex)) continue;
        if (++count % kInsertsBetweenCheckpoints == 0) {
            done_ += kInsertsBetweenCheckpoints;
            if (auto go = context_.checkpoint(); !go) {
                worker.error = go.error();
                return;
            }
            if (reports) context_.report("delaunay", done_, sites_.size());
        }
        switch (inserter.insert(vertex)) {
            case Insertion::kDone: break;
            case Insertion::kRepeated: worker.error = notDistinct(); return;
            case Insertion::kElsewhere:
            case Insertion::kNoRoom: worker.postponed.push_back(vertex); break;
        }
    }
    worker.freeCells.swap(inserter.freeCells());
    worker.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count();
}

}  // namespace shapedb
