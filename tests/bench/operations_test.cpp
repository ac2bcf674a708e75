// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "bench/models.h"
#include "core/synthetic/families.h"
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

namespace {

TEST(VerdictsBench, CountsVerdictsAndScoresOfSearchesItKnowsTheAnswersOf) {
    const BenchRun run = runBench({"verdicts", "--count", "1", "--json", "-"});
    ASSERT_EQ(run.exitCode, 0) << run.err;
    const auto hits = nlohmann::json::parse(run.out);
    ASSERT_GT(hits.size(), 300u);
    std::size_t same = 0;
    std::size_t high = 0;
    for (const auto& hit : hits) {
        EXPECT_GE(hit["score"], 0.0);
        if (hit["relation"] != "same object" || hit["change"] != "60 % of the points, 0.3 % noise") continue;
        ++same;
        high += hit["score"] >= 0.9 ? 1 : 0;
    }
    ASSERT_GE(same, 5u);
    EXPECT_GE(high + 1, same) << "two scans of one object score 0.9";
}

}  // namespace

namespace {

TEST(Views, OfSyntheticShapesAreFound) {
    const BenchRun run = runBench({"views", "--synthetic", "1", "--no-profile", "--threads", "1"});
    EXPECT_EQ(run.exitCode, 0) << run.err;
    EXPECT_NE(run.out.find("13 queries, 13 shapes"), std::string::npos) << run.out;
    EXPECT_NE(run.out.find("| views | "), std::string::npos) << run.out;
}

TEST(Views, NeedAGallery) { EXPECT_NE(runBench({"views"}).exitCode, 0); }

TEST(OneSidedScan, IsPartOfTheModelAndRepeats) {
    ScanOptions options;
    const PointCloud model = *scanOf(*makeMember("mug", 0, 1), options);
    OneSidedSettings settings;
    const auto scan = oneSidedScan(model, settings, 3, {});
    ASSERT_TRUE(scan);
    EXPECT_LT(scan->size(), model.size());
    EXPECT_EQ(*scan, *oneSidedScan(model, settings, 3, {}));
    EXPECT_NE(*scan, *oneSidedScan(model, settings, 4, {}));
}

}  // namespace

}  // namespace shapedb::bench
