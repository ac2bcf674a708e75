// SPDX-License-Identifier: GPL-3.0-or-later
#include "bench/typical.h"

#include <gtest/gtest.h>

#include "core/fit/fit.h"
#include "core/matching/attributed/attribute_distance.h"
#include "tests/bench/run_bench.h"

namespace shapedb::bench {
namespace {

// A smaller sample than that of `shapedb-bench typical`, whose medians are within 3 % of the constants, and
// 8 % for the parts.
TEST(Typical, CommittedConstantsFollowFromSyntheticFamilies) {
    TypicalSettings settings;
    settings.perFamily = 2;
    const auto result = measureTypical(settings, {});
    ASSERT_TRUE(result) << result.error().message;
    EXPECT_EQ(result->shapes, 26u);
    EXPECT_EQ(result->pairs, 26u * 24u / 2u);
    const auto kept = typicalDifferences();
    for (std::size_t i = 0; i < kept.size(); ++i) {
        EXPECT_NEAR(result->medians[i] / kept[i], 1.0, 0.1)
            << (i < kStatisticKinds ? kStatistics[i].name : "parts");
    }
    EXPECT_EQ(result->fits, result->pairs / settings.fitEvery);
    for (const FitKind kind : {FitKind::kWhole, FitKind::kOneSided, FitKind::kPiece}) {
        EXPECT_NEAR(result->misfits[static_cast<std::size_t>(kind)] / typicalMisfit(kind), 1.0, 0.1);
    }
}

TEST(Typical, RefusesToMeasureWithoutShapes) {
    TypicalSettings settings;
    settings.perFamily = 0;
    EXPECT_FALSE(measureTypical(settings, {}));
}

TEST(Typical, PrintsMediansBesideTheConstants) {
    const BenchRun run = runBench({"typical", "--count", "1", "--points", "2000"});
    EXPECT_EQ(run.exitCode, 0) << run.err;
    EXPECT_NE(run.out.find("78 pairs of different families among 13"), std::string::npos) << run.out;
    EXPECT_NE(run.out.find("| parts |"), std::string::npos);
}

}  // namespace
}  // namespace shapedb::bench
