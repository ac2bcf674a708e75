// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "tests/bench/run_bench.h"

namespace shapedb::bench {
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
}  // namespace shapedb::bench
