// Workers that insert points into one Delaunay triangulation at the same time.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/base/error.h"
#include "core/base/run_context.h"
#include "core/delaunay/bowyer_watson.h"

namespace shapedb {

/// Space is cut into slabs across its longest side, which makes for short borders, so that workers are done
/// at about the same time. Each inserts the points of its slab, without locks (Ownership).
class ParallelInsertion {
  public:
    static constexpr std::size_t kMostWorkers = 255;

    /// Everything must live as long as this. `workers`: at most kMostWorkers, to insert at least 1, on up to
    /// as many threads of the caller's arena. `done`: points inserted, for progress.
    ParallelInsertion(LargeVector<Site>& sites, CellStore& cells, std::size_t workers,
                      const RunContext& context, std::atomic<std::size_t>& done)
        : sites_(sites), cells_(cells), workers_(workers), context_(context), done_(done) {}

    /// Inserts the sites of `list`, which are in rising order and not empty; those along the borders stay in
    /// it. `freeCells`: cells of the store that are not in use, marked so, and what then is not.
    ///
    /// Errors: kInternal when two sites are at the same place; kCancelled, kDeadlineExceeded. May throw
    /// std::bad_alloc.
    [[nodiscard]] Result<void> insert(std::vector<std::uint32_t>& list,
                                      std::vector<std::uint32_t>& freeCells);
    /// The same for what that left, if anything, with slabs across the next longest side: once, and again
    /// across the last.
    [[nodiscard]] Result<void> insertLeft(std::vector<std::uint32_t>& list,
                                          std::vector<std::uint32_t>& freeCells);

  private:
    struct Worker;
    struct Slabs {
        std::size_t axis = 0;         // across which they lie
        std::vector<double> sample;   // places of some sites along it, rising
        std::vector<double> borders;  // between slabs: shares of the sample, from 0 to 1
    };

    Slabs makeSlabs(const std::vector<std::uint32_t>& list) const;
    Result<void> cut(const Slabs& slabs);
    Result<void> markInner();
    void moveBorders(const std::vector<double>& seconds);
    Result<std::vector<double>> insertSideBySide(std::vector<std::uint32_t>& list, std::uint32_t innerMark,
                                                 std::vector<std::uint32_t>& freeCells);
    void addStarts(std::vector<Worker>& workers) const;
    void work(const std::vector<std::uint32_t>& list, Worker& worker, bool reports);

    LargeVector<Site>& sites_;
    CellStore& cells_;
    std::size_t workers_;
    const RunContext& context_;
    std::atomic<std::size_t>& done_;
    Slabs slabs_;                       // of whole rounds
    std::array<bool, 3> isCut_{};       // of this round: whether it was cut across each axis
    std::vector<std::uint8_t> slabOf_;  // the worker of each site
};

}  // namespace shapedb
