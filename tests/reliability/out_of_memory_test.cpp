// Each allocation of each call of the store fails once: the error is clear, nothing is lost, and the store
// works on.
#include <gtest/gtest.h>

#include "tests/reliability/support/allocations.h"
#include "tests/reliability/support/moments.h"
#include "tests/support/scale.h"

namespace shapedb::reliability {
namespace {

// In CI one of so many allocations fails; SHAPEDB_TEST_SCALE divides it.
constexpr int kEveryAllocation = 200;
constexpr int kEveryOfMany = 1000;

std::uint64_t scaled(int every) {
    return static_cast<std::uint64_t>(std::max(1, every / testing::testScale()));
}

Trouble memoryTrouble(const std::string& name, bool lasting) {
    return {name,
            [=](std::uint64_t at) { Allocations::arm(at, lasting); },
            Allocations::disarm,
            Allocations::fired,
            Allocations::calls,
            [](ErrorCode code) { return code == ErrorCode::kOutOfMemory; },
            false};
}

void tryAllocations(const std::vector<Moment>& moments, std::uint64_t every) {
    Tally tally;
    const Trouble once = memoryTrouble("one allocation failing", false);
    const auto places = placesIn(moments, once);
    tryTrouble(moments, places, once, every, tally);
    tryTrouble(moments, places, memoryTrouble("allocations failing from then on,", true), every, tally);
    EXPECT_GT(tally.errors, 0u);
    std::cout << tally.places << " allocations, " << tally.tried << " made to fail: " << tally.errors
              << " errors, " << tally.unnoticed << " without consequence\n";
}

/// Steps that allocate several times as much as all others together, most of it in SQLite's parser.
bool isLarge(const Moment& moment) {
    const std::string& name = moment.step.name;
    return name == "create" || name == "open" || name == "reopen" || name == "restore" || name == "check";
}

std::vector<Moment> someOf(bool large) {
    std::vector<Moment> some;
    for (Moment& moment : recordWholeScript())
        if (isLarge(moment) == large) some.push_back(std::move(moment));
    return some;
}

TEST(OutOfMemoryTest, LosesNothingAndTheStoreWorksOn) {
    tryAllocations(someOf(false), scaled(kEveryAllocation));
}

TEST(OutOfMemoryTest, InOpeningRestoringAndChecking) { tryAllocations(someOf(true), scaled(kEveryOfMany)); }

TEST(OutOfMemoryTest, InMigrations) { tryAllocations(recordMigrations(), scaled(kEveryOfMany)); }

}  // namespace
}  // namespace shapedb::reliability
