// SPDX-License-Identifier: GPL-3.0-or-later
#include "bench/align.h"

#include <gtest/gtest.h>

#include "core/synthetic/families.h"
#include "tests/bench/run_bench.h"

namespace shapedb::bench {
namespace {

PointCloud model(const char* family) {
    ScanOptions options;
    options.randomPose = false;
    return *scanOf(*makeMember(family, 0, 1), options);
}

TEST(Align, AnErrorIsMeasuredFromBothSidesAndModuloSymmetry) {
    const PointCloud box = boxPoints(1.0, 2.0, 3.0, 8000, 1);
    Motion half;
    half.rotation = {{{-1, 0, 0}, {0, -1, 0}, {0, 0, 1}}};
    Motion shrunk;
    shrunk.scale = 0.5;
    EXPECT_EQ(motionError(box, {}, {}), 0.0);
    EXPECT_LT(motionError(box, half, {}), 0.01);
    EXPECT_GT(motionError(box, shrunk, {}), 0.05);
}

TEST(Align, FindsTheMotionsOfASyntheticShape) {
    const PointCloud shape = model("animal");
    for (const AlignCondition& condition : kAlignConditions) {
        const auto one = makeAlignCase(shape, condition, {}, 5);
        ASSERT_TRUE(one) << one.error().message;
        const auto outcome = measureAlignment(*one, condition, {}, {});
        ASSERT_TRUE(outcome) << outcome.error().message;
        EXPECT_LT(outcome->error, 0.02) << condition.name;
        EXPECT_LE(outcome->bestOfEqual, outcome->error);
        EXPECT_EQ(outcome->kind, condition.kind);
        EXPECT_GT(outcome->seconds, 0.0);
        const auto again = measureAlignment(*one, condition, {}, {});
        ASSERT_TRUE(again);
        EXPECT_EQ(again->error, outcome->error);
        EXPECT_EQ(again->score, outcome->score);
    }
}

TEST(Align, APeerIsMeasuredOnTheSameScans) {
    AlignSettings settings;
    settings.fit.keepScale = true;
    settings.fit.reflection = false;
    const auto one = makeAlignCase(model("animal"), kAlignConditions[0], settings, 5);
    ASSERT_TRUE(one) << one.error().message;
    const PeerAligner knowing{
        "told", [&](const PointCloud&, const PointCloud&) -> Result<Motion> { return one->truth; }};
    EXPECT_EQ(measureAlignment(*one, knowing).error, 0.0);
    const PeerAligner failing{"failing", [](const PointCloud&, const PointCloud&) -> Result<Motion> {
                                  return fail(ErrorCode::kInternal, "no");
                              }};
    EXPECT_EQ(measureAlignment(*one, failing).error, 1.0);
    const auto ours = measureAlignment(*one, kAlignConditions[0], settings, {});
    ASSERT_TRUE(ours);
    for (const PeerAligner& peer : peerAligners()) {
        EXPECT_LT(ours->error, measureAlignment(*one, peer).error + 1e-3) << peer.name;
    }
}

TEST_F(BenchTest, AlignPrintsALineForEachCondition) {
    const BenchRun run = runBench({"align", set(), "--per-folder", "1", "--noise", "0.001", "--misses"});
    EXPECT_EQ(run.exitCode, 0) << run.err;
    for (const AlignCondition& condition : kAlignConditions) {
        EXPECT_NE(run.out.find(std::string("| ") + condition.name + " | 3 |"), std::string::npos) << run.out;
    }
    EXPECT_NE(run.out.find("seed 1, scale free, reflection allowed, kind told"), std::string::npos)
        << run.out;
    EXPECT_EQ(runBench({"align"}).exitCode, 2);
    EXPECT_NE(runBench({"align", path("nowhere")}).exitCode, 0);
}

}  // namespace
}  // namespace shapedb::bench
