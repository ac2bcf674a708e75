// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "tests/bench/run_bench.h"

namespace shapedb::bench {
namespace {

class LeaveOutBench : public BenchTest {};

TEST_F(LeaveOutBench, MeasuresEachHalfOfTheClassesWithWhatIsBestOnTheOther) {
    const BenchRun run = runBench({"leave-classes-out", set(), "--noise", "0", "0.005"});
    ASSERT_EQ(run.exitCode, 0) << run.err;
    EXPECT_NE(run.out.find("9 shapes of 3 classes, 60 variants"), std::string::npos) << run.out;
    for (const char* row : {"| 2 classes | the other 1 | 0 % | ", "| 2 classes | the other 1 | 0.5 % | ",
                            "| 1 classes | the other 2 | 0 % | ", "| 1 classes | the other 2 | 0.5 % | "}) {
        EXPECT_NE(run.out.find(row), std::string::npos) << row << "\n" << run.out;
    }
    EXPECT_NE(run.out.find("| 1.000 / 1.000 / 1.000 |"), std::string::npos)
        << "a class alone has nothing else to find\n"
        << run.out;
    EXPECT_EQ(run.out.find("nan"), std::string::npos) << run.out;
}

TEST_F(LeaveOutBench, NeedsTwoClasses) {
    const BenchRun run = runBench({"leave-classes-out", set() + "/cube", "--noise", "0"});
    EXPECT_NE(run.exitCode, 0) << run.out;
    EXPECT_NE(run.err.find("two classes or more"), std::string::npos) << run.err;
}

}  // namespace
}  // namespace shapedb::bench
