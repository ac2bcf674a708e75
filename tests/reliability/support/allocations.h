// SPDX-License-Identifier: GPL-3.0-or-later
// Memory that runs out inside the store: operator new and SQLite's allocator, counted and made to fail.
#pragma once

#include <cstdint>
#include <vector>

namespace shapedb::reliability {

/// Process-wide; for one thread. Counts only inside calls of the store (InStore).
class Allocations {
  public:
    /// The `at`-th allocation (from 1) fails; with `lasting` those after it too.
    static void arm(std::uint64_t at, bool lasting);
    static void disarm();
    /// Since it was armed: whether one has failed, how many were asked for.
    static bool fired();
    static std::uint64_t calls();

    /// From now on the call stack of each allocation is looked at, until `newStacks`.
    static void watchStacks();
    /// The allocations since it was armed (from 1) whose call stack no earlier one had since `watchStacks`:
    /// after any other, the code goes the way it went after one of these.
    static std::vector<std::uint64_t> newStacks();
};

}  // namespace shapedb::reliability
