// SPDX-License-Identifier: GPL-3.0-or-later
// Cells from which a worker can start walking when it cannot get through from its last insertion.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "core/delaunay/cell.h"

namespace shapedb {

/// Some cells of one worker, by position along the Hilbert curve: one for each 1/4096 of the vertex numbers.
///
/// A cell may have been freed or reused since it was added; whoever visits it has to check.
class StartCells {
  public:
    explicit StartCells(std::size_t siteCount) : siteCount_(siteCount), cells_(kSlots, kNoCell) {}

    /// `vertex`: a finite corner of the cell.
    void add(std::uint32_t vertex, std::uint32_t cell) { cells_[slotOf(vertex)] = cell; }
    /// Calls `visit(cell)` for the cells of the slots around a vertex, nearest first, until it returns true.
    template <typename Visit>
    void visitNear(std::uint32_t vertex, const Visit& visit) const {
        const auto see = [&](std::size_t slot) { return cells_[slot] != kNoCell && visit(cells_[slot]); };
        const std::size_t middle = slotOf(vertex);
        for (std::size_t away = 0; away <= kReach; ++away) {
            if (middle + away < kSlots && see(middle + away)) return;
            if (away != 0 && away <= middle && see(middle - away)) return;
        }
    }

    static constexpr std::size_t kSlots = 4096;

  private:
    static constexpr std::size_t kReach = 3;  // slots to either side

    std::size_t slotOf(std::uint32_t vertex) const { return vertex * kSlots / siteCount_; }

    std::size_t siteCount_;
    std::vector<std::uint32_t> cells_;
};

}  // namespace shapedb
