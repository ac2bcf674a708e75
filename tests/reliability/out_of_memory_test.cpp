// SPDX-License-Identifier: GPL-3.0-or-later
// Each allocation of each call of the store fails once: the error is clear, nothing is lost, and the store
// works on.
#include <gtest/gtest.h>

#include "tests/reliability/support/allocations.h"
#include "tests/reliability/support/moments.h"
#include "tests/support/scale.h"

namespace shapedb::reliability {
namespace {

// In CI one of so many of the places fails; SHAPEDB_TEST_SCALE divides it.
constexpr int kEveryStack = 40;

Trouble memoryTrouble(const std::string& name, bool lasting) {
    return {name,
            [=](std::uint64_t at) { Allocations::arm(at, lasting); },
            Allocations::disarm,
            Allocations::fired,
            Allocations::calls,
            [](ErrorCode code) { return code == ErrorCode::kOutOfMemory; },
            false};
}

/// At the first allocation of every call stack: at another with the same stack the code goes the same way.
void tryAllocations(const std::vector<Moment>& moments) {
    const auto every = static_cast<std::uint64_t>(std::max(1, kEveryStack / testing::testScale()));
    Tally tally;
    const Trouble once = memoryTrouble("one allocation failing", false);
    const Places places =
        chosenPlaces(every, moments, once, Allocations::watchStacks, Allocations::newStacks);
    tryTrouble(moments, places, once, tally);
    tryTrouble(moments, places, memoryTrouble("allocations failing from then on,", true), tally);
    EXPECT_GT(tally.errors, 0u);
    std::cout << places.all << " allocations, " << tally.tried << " made to fail: " << tally.errors
              << " errors, " << tally.unnoticed << " without consequence\n";
}

TEST(OutOfMemoryTest, LosesNothingAndTheStoreWorksOn) { tryAllocations(recordWholeScript()); }

TEST(OutOfMemoryTest, InMigrations) { tryAllocations(recordMigrations()); }

}  // namespace
}  // namespace shapedb::reliability
