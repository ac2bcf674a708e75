// Memory that runs out inside the store: operator new and SQLite's allocator, counted and made to fail.
#pragma once

#include <cstdint>

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
};

}  // namespace shapedb::reliability
