// SPDX-License-Identifier: GPL-3.0-or-later
// Calls of the operating system that fail, each of them once: the error is clear, nothing is lost, and the
// store works on.
#include <gtest/gtest.h>

#include "tests/reliability/support/faults.h"
#include "tests/reliability/support/moments.h"
#include "tests/support/scale.h"

namespace shapedb::reliability {
namespace {

// In CI one of so many calls fails; SHAPEDB_TEST_SCALE divides it.
constexpr int kEveryCall = 40;

Trouble ioTrouble(const std::string& name, FaultKind kind, bool lasting) {
    return {name,
            [=](std::uint64_t at) { Faults::arm(kind, at, lasting); },
            Faults::disarm,
            Faults::fired,
            Faults::calls,
            [=](ErrorCode code) {
                if (kind == FaultKind::kNoSpace) return code == ErrorCode::kStorageFull;
                return code == ErrorCode::kStorage || code == ErrorCode::kFileNotWritable ||
                       code == ErrorCode::kFileNotReadable;
            },
            kind == FaultKind::kSync};
}

class IoErrorTest : public ::testing::TestWithParam<FaultKind> {
  protected:
    void tryAll(const std::vector<Moment>& moments) {
        const auto every = static_cast<std::uint64_t>(std::max(1, kEveryCall / testing::testScale()));
        Tally tally;
        const Trouble once = ioTrouble("one fault", GetParam(), false);
        const Places places = everyPlace(every, moments, once);
        tryTrouble(moments, places, once, tally);
        tryTrouble(moments, places, ioTrouble("faults from then on,", GetParam(), true), tally);
        EXPECT_GT(tally.errors, 0u);
        std::cout << places.all << " calls, " << tally.tried << " made to fail: " << tally.errors
                  << " errors, " << tally.unnoticed << " without consequence\n";
    }

    const FaultVfs vfs_;
};

INSTANTIATE_TEST_SUITE_P(Kinds, IoErrorTest,
                         ::testing::Values(FaultKind::kNoSpace, FaultKind::kIo, FaultKind::kShortWrite,
                                           FaultKind::kSync));

TEST_P(IoErrorTest, LosesNothingAndTheStoreWorksOn) { tryAll(recordWholeScript()); }

TEST_P(IoErrorTest, MigrationsSurviveIoErrors) { tryAll(recordMigrations()); }

}  // namespace
}  // namespace shapedb::reliability
