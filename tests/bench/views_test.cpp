// SPDX-License-Identifier: GPL-3.0-or-later
#include <gtest/gtest.h>

#include "bench/one_sided.h"
#include "core/synthetic/families.h"
#include "tests/bench/run_bench.h"

namespace shapedb::bench {
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
