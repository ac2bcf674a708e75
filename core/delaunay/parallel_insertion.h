// SPDX-License-Identifier: GPL-3.0-or-later
// Workers that insert points into one Delaunay triangulation at the same time, without locks.
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

/// Cuts space into one slab for each worker. Each worker inserts the sites of its slab and obeys the rules of
/// Ownership; sites whose cavities reach across a border stay behind. Borders move from round to round, so
/// that workers finish at about the same time.
///
/// The clock decides where borders lie, and so which sites stay behind and where cells lie in the store. The
/// set of cells does not depend on any of that.
class ParallelInsertion {
  public:
    static constexpr std::size_t kMaxWorkers = 255;

    /// References must stay valid. `workers`: 1 to kMaxWorkers (0 if nothing will be inserted), on at most as
    /// many threads of the caller's arena. `done`: the number of sites inserted, for progress.
    ParallelInsertion(LargeVector<Site>& sites, CellStore& cells, std::size_t workers,
                      const RunContext& context, std::atomic<std::size_t>& done)
        : sites_(sites), cells_(cells), workers_(workers), context_(context), done_(done) {}

    /// Inserts the sites of `list`, which must be ascending and not empty, and leaves in it, ascending, those
    /// that could not be inserted. `freeCells`: in, the free cells of the store, for use here; out, those
    /// that are free then.
    ///
    /// Errors: kInternal when two sites coincide; kCancelled, kDeadlineExceeded; after an error the
    /// triangulation is unusable. May throw std::bad_alloc.
    [[nodiscard]] Result<void> insert(std::vector<std::uint32_t>& list,
                                      std::vector<std::uint32_t>& freeCells);
    /// The same for what `insert` left, with slabs across the longest side not cut yet in this round. May be
    /// called twice after each `insert`.
    [[nodiscard]] Result<void> insertPending(std::vector<std::uint32_t>& list,
                                             std::vector<std::uint32_t>& freeCells);

  private:
    struct Worker;
    struct Slabs {
        std::size_t axis = 0;         // to which their borders are perpendicular
        std::vector<double> sample;   // coordinates of some sites along it, ascending
        std::vector<double> borders;  // as fractions of the sample, from 0 to 1
    };

    Slabs makeSlabs(const std::vector<std::uint32_t>& list) const;
    Result<void> assignOwners(const Slabs& slabs);
    Result<void> markSolelyOwned();
    void moveBorders(const std::vector<double>& seconds);
    Result<std::vector<double>> runWorkers(std::vector<std::uint32_t>& list, std::uint32_t soleOwnerMark,
                                           std::vector<std::uint32_t>& freeCells);
    void addStarts(std::vector<Worker>& workers) const;
    void work(const std::vector<std::uint32_t>& list, Worker& worker, bool reports);

    LargeVector<Site>& sites_;
    CellStore& cells_;
    std::size_t workers_;
    const RunContext& context_;
    std::atomic<std::size_t>& done_;
    Slabs slabs_;                         // of `insert`, kept from round to round
    std::array<bool, 3> isCut_{};         // axes cut in this round
    std::vector<std::uint8_t> workerOf_;  // by site
};

}  // namespace shapedb
