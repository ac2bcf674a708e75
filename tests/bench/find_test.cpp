// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "tests/bench/run_bench.h"

namespace shapedb::bench {
namespace {

TEST(FindBench, FindsReScansFirstAndCountsEverySearch) {
    const BenchRun run =
        runBench({"find", "--count", "1", "--change", "rescan", "--change", "table", "--json", "-"});
    ASSERT_EQ(run.exitCode, 0) << run.err;
    const auto searches = nlohmann::json::parse(run.out);
    std::size_t rescans = 0;
    std::size_t first = 0;
    std::size_t onTable = 0;
    for (const auto& search : searches) {
        EXPECT_GT(search["seconds"], 0.0);
        onTable += search["change"] == "table" ? 1 : 0;
        if (search["change"] != "rescan") continue;
        ++rescans;
        first += search["rank"] == 1 ? 1 : 0;
    }
    EXPECT_GE(rescans, 12u);
    EXPECT_GE(onTable, 12u);
    EXPECT_GE(first + 1, rescans);
}

TEST(FindBench, FillsTheGalleryWithGeneratedShapes) {
    const BenchRun run = runBench({"find", "--count", "1", "--per-class", "1", "--fill", "500", "--change",
                                   "piece65", "--partial", "--candidates", "20"});
    ASSERT_EQ(run.exitCode, 0) << run.err;
    EXPECT_NE(run.out.find("Gallery of 513 shapes"), std::string::npos) << run.out;
    EXPECT_NE(run.out.find("| 65 % left | 13 |"), std::string::npos) << run.out;
    EXPECT_NE(run.out.find("| 20 |"), std::string::npos) << "candidates\n" << run.out;
    EXPECT_NE(runBench({"find", "--change", "nothing"}).exitCode, 0);
}

}  // namespace
}  // namespace shapedb::bench
