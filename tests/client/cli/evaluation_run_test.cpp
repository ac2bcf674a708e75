// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/evaluation_run.h"

#include <mutex>

#include "tests/client/cli/run_command.h"

namespace shapedb::cli {
namespace {

class EvaluationRun : public CommandTest {
  protected:
    void SetUp() override {
        writePoints("set/round/1.xyz", ellipsoidPoints(1.0, 0.9, 0.8, 600));
        writePoints("set/round/2.xyz", ellipsoidPoints(2.0, 1.8, 1.5, 600));
        writePoints("set/bell/1.xyz", dumbbellPoints(1500));
        PointCloud flat = ellipsoidPoints(1.0, 1.0, 0.0, 200);
        writePoints("set/bell/flat.xyz", flat);
    }

    std::vector<EvaluatedShape> described(unsigned threads, const ScanFlags& flags = {}) {
        std::vector<EvaluatedShape> shapes = listed();
        const auto done = describeShapes(shapes, flags, parametersOf(Profile::kPaper), false, threads,
                                         [](std::size_t) {}, {});
        EXPECT_TRUE(done) << done.error().message;
        return shapes;
    }

    std::vector<EvaluatedShape> listed() const {
        const auto scans = listCollection({path("set")});
        EXPECT_TRUE(scans);
        return shapesOf(*scans);
    }
};

TEST_F(EvaluationRun, AShapeThatCannotBeSegmentedIsAFailureAndScoresZero) {
    const auto shapes = described(2);
    EXPECT_EQ(shapes[1].name, "bell/flat.xyz");
    ASSERT_TRUE(shapes[1].failure);
    EXPECT_EQ(shapes[1].failure->code, ErrorCode::kCoplanar);
    EXPECT_FALSE(shapes[1].signature);
    const auto scores = scorePairs(shapes, shapes, {}, 2, [](std::size_t) {}, {});
    ASSERT_TRUE(scores);
    for (std::size_t i = 0; i < 4; ++i) {
        EXPECT_EQ((*scores)[1 * 4 + i], 0.0);
        EXPECT_EQ((*scores)[i * 4 + 1], 0.0);
    }
    EXPECT_EQ((*scores)[0], 1.0) << "a shape against itself";
}

TEST_F(EvaluationRun, ResultDoesNotDependOnThreads) {
    ScanFlags noisy;
    noisy.noise = 0.004;
    noisy.points = 500;
    const auto one = described(1, noisy);
    const auto four = described(4, noisy);
    for (std::size_t i = 0; i < one.size(); ++i) {
        ASSERT_EQ(one[i].signature.has_value(), four[i].signature.has_value());
        if (one[i].signature) {
            EXPECT_TRUE(sameShape(*one[i].signature, *four[i].signature)) << one[i].name;
        }
    }
    EXPECT_EQ(*scorePairs(one, one, {}, 1, [](std::size_t) {}, {}),
              *scorePairs(four, four, {}, 4, [](std::size_t) {}, {}));
}

TEST_F(EvaluationRun, ScoringHalfThePairsFillsTheMatrix) {
    const auto shapes = described(2);
    const auto copy = shapes;
    for (const bool partial : {false, true}) {
        ScoreOptions options;
        options.partial = partial;
        const auto half = scorePairs(shapes, shapes, options, 2, [](std::size_t) {}, {});
        const auto full = scorePairs(shapes, copy, options, 2, [](std::size_t) {}, {});
        ASSERT_TRUE(half && full);
        EXPECT_EQ(*half, *full) << "partial " << partial;
    }
}

TEST_F(EvaluationRun, ProgressCountsEveryShapeOnce) {
    std::vector<EvaluatedShape> shapes = listed();
    std::mutex mutex;
    std::vector<std::size_t> counts;
    const auto done = describeShapes(shapes, {}, parametersOf(Profile::kPaper), false, 3,
                                     [&](std::size_t count) {
                                         const std::lock_guard<std::mutex> lock(mutex);
                                         counts.push_back(count);
                                     },
                                     {});
    ASSERT_TRUE(done);
    EXPECT_EQ(counts.size(), 4u);
}

TEST_F(EvaluationRun, StopsWhenCancelled) {
    std::vector<EvaluatedShape> shapes = listed();
    std::atomic<bool> cancel{true};
    RunContext context;
    context.cancel = &cancel;
    const auto done = describeShapes(
        shapes, {}, parametersOf(Profile::kPaper), false, 2, [](std::size_t) {}, context);
    ASSERT_FALSE(done);
    EXPECT_EQ(done.error().code, ErrorCode::kCancelled);
    const auto scores = scorePairs(
        shapes, shapes, {}, 2, [](std::size_t) {}, context);
    ASSERT_FALSE(scores);
    EXPECT_EQ(scores.error().code, ErrorCode::kCancelled);
}

}  // namespace
}  // namespace shapedb::cli
