// SPDX-License-Identifier: GPL-3.0-or-later
#include "bench/retrieval_run.h"

#include <atomic>

#include <gmock/gmock.h>

#include "tests/bench/run_bench.h"

namespace shapedb::bench {
namespace {

using ::testing::HasSubstr;

class RetrievalRun : public BenchTest {
  protected:
    RetrievalTask leaveOneOut() const {
        RetrievalTask task;
        const auto scans = cli::listClasses(set());
        EXPECT_TRUE(scans);
        task.queries = *scans;
        return task;
    }

    static std::vector<LevelResult> measured(const RetrievalTask& task, const RetrievalSettings& settings,
                                             const std::vector<Method>& methods) {
        const auto levels =
            runRetrieval(task, settings, methods, [](const std::string&, std::size_t, std::size_t) {}, {});
        EXPECT_TRUE(levels) << levels.error().message;
        return levels ? *levels : std::vector<LevelResult>();
    }

    static std::vector<Method> d2() { return *methodsNamed({"d2"}); }
};

/// Gives every scan the spread of its x coordinates: changes when a shape is turned.
Method xSpread() {
    return histogramMethod("x", "x spread", "L1", l1Distance,
                           [](const PointCloud& points, std::uint64_t) -> Result<Histogram> {
                               double low = points.front().x;
                               double high = low;
                               for (const Point3& p : points) {
                                   low = std::min(low, p.x);
                                   high = std::max(high, p.x);
                               }
                               return Histogram{static_cast<float>(high - low)};
                           });
}

TEST_F(RetrievalRun, PlainShapesAreFound) {
    const auto levels = measured(leaveOneOut(), {}, d2());
    ASSERT_EQ(levels.size(), 1u);
    const MethodResult& result = levels[0].methods.at(0);
    EXPECT_EQ(result.metrics.nearestNeighbour, 1.0);
    EXPECT_EQ(result.precision.size(), 20u);
    EXPECT_TRUE(result.failures.empty());
    EXPECT_GT(result.secondsPerShape, 0.0);
    EXPECT_GT(result.secondsPerPair, 0.0);
}

TEST_F(RetrievalRun, SameForAnyNumberOfThreads) {
    RetrievalSettings settings;
    settings.noise = {0.0, 0.02};
    const auto one = measured(leaveOneOut(), settings, d2());
    settings.threads = 4;
    const auto four = measured(leaveOneOut(), settings, d2());
    for (std::size_t level = 0; level < 2; ++level) {
        EXPECT_EQ(one[level].methods[0].precision, four[level].methods[0].precision);
        EXPECT_EQ(one[level].methods[0].metrics.dcg, four[level].methods[0].metrics.dcg);
    }
}

TEST_F(RetrievalRun, ScansAreRotatedUnlessDisabled) {
    // All nine scans ask for themselves: only unturned does the spread along x stay what it was.
    RetrievalTask task = leaveOneOut();
    task.gallery = task.queries;
    task.match = cli::Match::kStem;
    RetrievalSettings settings;
    settings.rotate = false;
    std::vector<float> spreads;
    const auto spreadsOf = [&] {
        Method method = xSpread();
        std::vector<float> seen;
        const auto inner = method.describe;
        method.describe = [&seen, inner](const PointCloud& points, std::uint64_t seed,
                                         const RunContext& context) {
            auto features = inner(points, seed, context);
            seen.push_back(std::get<Histogram>(*features)[0]);
            return features;
        };
        RetrievalTask own = leaveOneOut();
        own.queries.resize(3);
        measured(own, settings, {method});
        return seen;
    };
    const auto still = spreadsOf();
    ASSERT_EQ(still.size(), 3u);
    EXPECT_NEAR(still[0], 1.0, 1e-6) << "the cube as written";
    settings.rotate = true;
    const auto turned = spreadsOf();
    EXPECT_GT(turned[0], 1.02) << "the width of a cube that does not stand on a face";
    EXPECT_EQ(turned, spreadsOf()) << "the same pose in every run";
    settings.scan.seed = 2;
    EXPECT_NE(turned, spreadsOf());
}

TEST_F(RetrievalRun, AScanThatCannotBeDescribedRanksLast) {
    // First in the order of files, where a tie would be broken in its favour.
    writePoints("set/cube/0.xyz", PointCloud(50, Point3{1.0, 1.0, 1.0}));
    const auto levels = measured(leaveOneOut(), {}, d2());
    const MethodResult& result = levels[0].methods[0];
    ASSERT_EQ(result.failures.size(), 1u);
    EXPECT_EQ(result.failures[0].error.code, ErrorCode::kAllPointsEqual);
    EXPECT_FALSE(result.failures[0].unreadable);
    EXPECT_NEAR(result.metrics.nearestNeighbour, 9.0 / 10.0, 1e-12);
    // It misses both tiers; of the three good cubes each finds two of three.
    EXPECT_NEAR(result.metrics.firstTier, (6.0 + 3.0 * 2.0 / 3.0) / 10.0, 1e-12);
}

TEST_F(RetrievalRun, AFileThatCannotBeReadFailsForEveryMethod) {
    write("set/rod/broken.ply", "ply\nformat ascii 1.0\nelement vertex 10\n");
    const auto levels = measured(leaveOneOut(), {}, *methodsNamed({"paper", "d2"}));
    for (const MethodResult& method : levels[0].methods) {
        ASSERT_EQ(method.failures.size(), 1u) << method.name;
        EXPECT_TRUE(method.failures[0].unreadable);
        EXPECT_THAT(method.failures[0].path, HasSubstr("broken.ply"));
    }
}

TEST_F(RetrievalRun, QueriesFindTheirCleanTwinInAGallery) {
    RetrievalTask task = leaveOneOut();
    for (const cli::CollectionScan& scan : task.queries) {
        if (scan.name != "rod/2.xyz") task.gallery.push_back(scan);
    }
    task.queries = {{path("set/rod/1.xyz"), "rod/1.xyz", "rod"}};
    task.match = cli::Match::kFolder;
    const auto levels = measured(task, {}, d2());
    const MethodResult& result = levels[0].methods[0];
    EXPECT_EQ(result.gallery.queries, 1u);
    EXPECT_EQ(result.gallery.meanReciprocalRank, 1.0);
    ASSERT_EQ(result.queries.size(), 1u);
    EXPECT_EQ(result.queries[0].rank, 1u);
    EXPECT_EQ(result.queries[0].firstHit, "rod/3.xyz") << "by folder not itself";
    EXPECT_LT(result.queries[0].score, 0.0);
}

TEST_F(RetrievalRun, NoiseAppliesToQueriesOnly) {
    RetrievalTask task = leaveOneOut();
    task.gallery = task.queries;
    task.match = cli::Match::kStem;
    RetrievalSettings settings;
    settings.rotate = false;
    settings.noise = {0.0, 0.1};
    const auto levels = measured(task, settings, {xSpread()});
    EXPECT_EQ(levels[0].methods[0].queries[0].score, 0.0) << "the clean query finds itself";
    EXPECT_LT(levels[1].methods[0].queries[0].score, 0.0);
}

TEST_F(RetrievalRun, StopsWhenCancelled) {
    const std::atomic<bool> cancel{true};
    RunContext context;
    context.cancel = &cancel;
    const auto levels = runRetrieval(
        leaveOneOut(), {}, d2(), [](const std::string&, std::size_t, std::size_t) {}, context);
    ASSERT_FALSE(levels);
    EXPECT_EQ(levels.error().code, ErrorCode::kCancelled);
}

}  // namespace
}  // namespace shapedb::bench
