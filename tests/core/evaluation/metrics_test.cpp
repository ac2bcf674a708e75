// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/evaluation/metrics.h"

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "core/base/random.h"

namespace shapedb {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// The definitions, written a second time without sorting: a candidate's rank is one plus the
// number of candidates before it, and every measure is a sum over pairs.
struct Reference {
    const ScoreMatrix& scores;
    const std::vector<std::string>& labels;

    std::size_t n() const { return labels.size(); }
    bool right(std::size_t q, std::size_t c) const { return q != c && labels[q] == labels[c]; }
    bool before(std::size_t q, std::size_t a, std::size_t b) const {
        const double sa = scores[q * n() + a];
        const double sb = scores[q * n() + b];
        return sa > sb || (sa == sb && a < b);
    }
    double rank(std::size_t q, std::size_t c) const {
        double rank = 1.0;
        for (std::size_t i = 0; i < n(); ++i) rank += i != q && i != c && before(q, i, c) ? 1.0 : 0.0;
        return rank;
    }
    double rightUpTo(std::size_t q, double last) const {
        double found = 0.0;
        for (std::size_t c = 0; c < n(); ++c) found += right(q, c) && rank(q, c) <= last ? 1.0 : 0.0;
        return found;
    }
    static double gain(double rank) { return rank < 2.0 ? 1.0 : std::log(2.0) / std::log(rank); }

    RetrievalMetrics query(std::size_t q) const {
        RetrievalMetrics m;
        const double relevant = rightUpTo(q, static_cast<double>(n()));
        if (relevant == 0.0) return m;
        m.nearestNeighbour = rightUpTo(q, 1.0);
        m.firstTier = rightUpTo(q, relevant) / relevant;
        m.secondTier = rightUpTo(q, 2.0 * relevant) / relevant;
        double ideal = 0.0;
        for (double r = 1.0; r <= relevant; ++r) ideal += gain(r);
        for (std::size_t c = 0; c < n(); ++c) {
            if (!right(q, c)) continue;
            m.dcg += gain(rank(q, c)) / ideal;
            m.averagePrecision += rightUpTo(q, rank(q, c)) / rank(q, c) / relevant;
        }
        return m;
    }
};

void expectSame(const RetrievalMetrics& a, const RetrievalMetrics& b) {
    EXPECT_NEAR(a.nearestNeighbour, b.nearestNeighbour, 1e-12);
    EXPECT_NEAR(a.firstTier, b.firstTier, 1e-12);
    EXPECT_NEAR(a.secondTier, b.secondTier, 1e-12);
    EXPECT_NEAR(a.dcg, b.dcg, 1e-12);
    EXPECT_NEAR(a.averagePrecision, b.averagePrecision, 1e-12);
}

ScoreMatrix randomScores(std::size_t n, std::uint64_t seed, std::uint64_t levels) {
    Random random(seed);
    ScoreMatrix scores(n * n);
    for (double& s : scores) s = static_cast<double>(random.below(levels)) / static_cast<double>(levels);
    return scores;
}

std::vector<std::string> randomLabels(std::size_t n, std::uint64_t seed, std::uint64_t classes) {
    Random random(seed);
    std::vector<std::string> labels;
    for (std::size_t i = 0; i < n; ++i) labels.push_back("class" + std::to_string(random.below(classes)));
    return labels;
}

// Class a = {0, 1, 2}, class b = {3, 4}; worked by hand, one query at a time.
//   query 0 ranks 3 1 4 2: right at ranks 2 and 4 of R = 2
//   query 1 ranks 0 2 3 4: right at ranks 1 and 2
//   query 2 ranks 3 4 0 1: right at ranks 3 and 4
//   query 3 ranks 4 0 1 2 (4 first; 0, 1, 2 tie and go by index): right at rank 1 of R = 1
//   query 4 ranks 0 3 1 2 (0 and 3 tie, 0 goes first): right at rank 2
TEST(LeaveOneOut, HandComputedExample) {
    const std::vector<std::string> labels = {"a", "a", "a", "b", "b"};
    const ScoreMatrix scores = {1.0, 0.8, 0.2, 0.9, 0.5,  //
                                0.9, 1.0, 0.8, 0.7, 0.6,  //
                                0.4, 0.3, 1.0, 0.9, 0.8,  //
                                0.1, 0.1, 0.1, 1.0, 0.2,  //
                                0.7, 0.2, 0.1, 0.7, 1.0};
    const auto report = evaluateLeaveOneOut(scores, labels);
    ASSERT_TRUE(report);
    EXPECT_EQ(report->queries, 5U);
    EXPECT_EQ(report->lonely, 0U);

    // Gains by rank: 1, 1, 0.63093, 0.5; two right candidates ideally gain 1 + 1.
    const double gain3 = 0.6309297535714574;
    const std::vector<RetrievalMetrics> expected = {
        {0.0, 0.5, 1.0, 1.5 / 2.0, (1.0 / 2.0 + 2.0 / 4.0) / 2.0},
        {1.0, 1.0, 1.0, 1.0, 1.0},
        {0.0, 0.0, 1.0, (gain3 + 0.5) / 2.0, (1.0 / 3.0 + 2.0 / 4.0) / 2.0},
        {1.0, 1.0, 1.0, 1.0, 1.0},
        {0.0, 0.0, 1.0, 1.0, 0.5},
    };
    ASSERT_EQ(report->perQuery.size(), 5U);
    for (std::size_t q = 0; q < 5; ++q) {
        SCOPED_TRACE(q);
        expectSame(report->perQuery[q], expected[q]);
    }
    EXPECT_NEAR(report->mean.nearestNeighbour, 2.0 / 5.0, 1e-12);
    EXPECT_NEAR(report->mean.firstTier, 2.5 / 5.0, 1e-12);
    EXPECT_NEAR(report->mean.secondTier, 1.0, 1e-12);
    EXPECT_NEAR(report->mean.dcg, (0.75 + 1.0 + (gain3 + 0.5) / 2.0 + 1.0 + 1.0) / 5.0, 1e-12);
    EXPECT_NEAR(report->mean.averagePrecision, (0.5 + 1.0 + 5.0 / 12.0 + 1.0 + 0.5) / 5.0, 1e-12);

    ASSERT_EQ(report->perClass.size(), 2U);
    EXPECT_EQ(report->perClass[0].name, "a");
    EXPECT_EQ(report->perClass[0].queries, 3U);
    EXPECT_NEAR(report->perClass[0].mean.averagePrecision, (0.5 + 1.0 + 5.0 / 12.0) / 3.0, 1e-12);
    EXPECT_EQ(report->perClass[1].name, "b");
    EXPECT_EQ(report->perClass[1].queries, 2U);
    EXPECT_NEAR(report->perClass[1].mean.nearestNeighbour, 0.5, 1e-12);
}

TEST(LeaveOneOut, AgreesWithThePairwiseDefinitions) {
    for (std::uint64_t seed = 0; seed < 40; ++seed) {
        SCOPED_TRACE(seed);
        const std::size_t n = 2 + static_cast<std::size_t>(seed);
        // Few score levels on purpose: ties everywhere.
        const ScoreMatrix scores = randomScores(n, seed, seed % 3 == 0 ? 4 : 1000);
        const auto labels = randomLabels(n, seed + 1000, 1 + seed % 7);
        const auto report = evaluateLeaveOneOut(scores, labels);
        ASSERT_TRUE(report);
        const Reference reference{scores, labels};
        for (std::size_t q = 0; q < n; ++q) expectSame(report->perQuery[q], reference.query(q));
        EXPECT_EQ(report->queries + report->lonely, n);
    }
}

TEST(LeaveOneOut, MeansAreOverQueriesAndClasses) {
    const std::size_t n = 60;
    const auto labels = randomLabels(n, 5, 5);
    const auto report = evaluateLeaveOneOut(randomScores(n, 6, 1000), labels);
    ASSERT_TRUE(report);
    double total = 0.0;
    for (const RetrievalMetrics& m : report->perQuery) total += m.dcg;
    EXPECT_NEAR(report->mean.dcg, total / static_cast<double>(report->queries), 1e-12);
    double weighted = 0.0;
    std::size_t queries = 0;
    for (const ClassMetrics& c : report->perClass) {
        weighted += c.mean.dcg * static_cast<double>(c.queries);
        queries += c.queries;
    }
    EXPECT_EQ(queries, report->queries);
    EXPECT_NEAR(weighted, total, 1e-9);
}

TEST(LeaveOneOut, PerfectAndWorstScores) {
    const std::vector<std::string> labels = {"x", "y", "x", "y", "x", "y"};
    ScoreMatrix perfect(36);
    ScoreMatrix worst(36);
    for (std::size_t i = 0; i < 36; ++i) {
        perfect[i] = labels[i / 6] == labels[i % 6] ? 1.0 : 0.0;
        worst[i] = 1.0 - perfect[i];
    }
    const auto best = evaluateLeaveOneOut(perfect, labels);
    ASSERT_TRUE(best);
    expectSame(best->mean, {1.0, 1.0, 1.0, 1.0, 1.0});
    const auto bad = evaluateLeaveOneOut(worst, labels);
    ASSERT_TRUE(bad);
    EXPECT_EQ(bad->mean.nearestNeighbour, 0.0);
    EXPECT_EQ(bad->mean.firstTier, 0.0);
    EXPECT_NEAR(bad->mean.secondTier, 0.5, 1e-12);  // ranks 4 and 5 of 2 R = 4: one of two
    EXPECT_GT(bad->mean.averagePrecision, 0.0);
}

TEST(LeaveOneOut, AClassOfOneAsksNoQueryButIsACandidate) {
    const std::vector<std::string> labels = {"a", "a", "alone"};
    const ScoreMatrix scores = {1, 0.1, 0.9, 0.5, 1, 0.4, 0.3, 0.2, 1};
    const auto report = evaluateLeaveOneOut(scores, labels);
    ASSERT_TRUE(report);
    EXPECT_EQ(report->queries, 2U);
    EXPECT_EQ(report->lonely, 1U);
    EXPECT_NEAR(report->mean.nearestNeighbour, 0.5, 1e-12);  // "alone" beats 1 for query 0
    ASSERT_EQ(report->perClass.size(), 2U);
    EXPECT_EQ(report->perClass[1].name, "alone");
    EXPECT_EQ(report->perClass[1].queries, 0U);
    expectSame(report->perClass[1].mean, {});
}

TEST(LeaveOneOut, OnlyLonelyShapes) {
    const auto report = evaluateLeaveOneOut({1, 0, 0, 1}, {"a", "b"});
    ASSERT_TRUE(report);
    EXPECT_EQ(report->queries, 0U);
    EXPECT_EQ(report->lonely, 2U);
    expectSame(report->mean, {});
}

TEST(LeaveOneOut, TheDiagonalIsNeverRead) {
    const std::vector<std::string> labels = {"a", "b", "a", "b"};
    ScoreMatrix scores = randomScores(4, 1, 100);
    const auto before = evaluateLeaveOneOut(scores, labels);
    for (std::size_t i = 0; i < 4; ++i) scores[i * 4 + i] = i % 2 == 0 ? kNaN : kInfinity;
    const auto after = evaluateLeaveOneOut(scores, labels);
    ASSERT_TRUE(before && after);
    expectSame(before->mean, after->mean);
}

TEST(LeaveOneOut, InfiniteScoresRank) {
    const auto report = evaluateLeaveOneOut({1, kInfinity, 5, 0, 1, -kInfinity, 1, 1, 1}, {"a", "a", "b"});
    ASSERT_TRUE(report);
    EXPECT_EQ(report->mean.nearestNeighbour, 1.0);
}

TEST(LeaveOneOut, RefusesSizesThatDoNotFit) {
    for (const std::size_t size : {0U, 3U, 5U, 8U, 16U}) {
        const auto report = evaluateLeaveOneOut(ScoreMatrix(size, 0.5), {"a", "a", "b"});
        ASSERT_FALSE(report) << size;
        EXPECT_EQ(report.error().code, ErrorCode::kInvalidArgument);
    }
    const auto none = evaluateLeaveOneOut({}, {});
    ASSERT_FALSE(none);
    EXPECT_EQ(none.error().code, ErrorCode::kInvalidArgument);
}

TEST(LeaveOneOut, NamesTheScoreThatIsNotANumber) {
    ScoreMatrix scores(16, 0.5);
    scores[2 * 4 + 3] = kNaN;
    const auto report = evaluateLeaveOneOut(scores, {"a", "a", "b", "b"});
    ASSERT_FALSE(report);
    EXPECT_EQ(report.error().code, ErrorCode::kInvalidArgument);
    EXPECT_NE(report.error().message.find("query 2"), std::string::npos);
    EXPECT_NE(report.error().message.find("candidate 3"), std::string::npos);
}

TEST(Gallery, HandComputedExample) {
    const std::vector<GalleryQuery> queries = {
        {{4, 2, 0, 1, 3, 5, 6}, {4}},     // first
        {{4, 2, 0, 1, 3, 5, 6}, {5, 0}},  // third: the better of two right ones counts
        {{6, 5, 4, 3, 2, 1, 0}, {1}},     // sixth: no hit among five
        {{6, 5}, {0}},                    // a short list that misses it
        {{0, 1, 2}, {}},                  // nothing to find
        {{}, {3}},                        // nothing ranked
    };
    const auto report = evaluateGallery(queries, 7);
    ASSERT_TRUE(report);
    EXPECT_EQ(report->queries, 5U);
    EXPECT_EQ(report->withoutRightAnswer, 1U);
    EXPECT_EQ(report->firstRightRank, (std::vector<std::size_t>{1, 3, 6, 0, 0, 0}));
    EXPECT_NEAR(report->hitAt1, 1.0 / 5.0, 1e-12);
    EXPECT_NEAR(report->hitAt5, 2.0 / 5.0, 1e-12);
    EXPECT_NEAR(report->meanReciprocalRank, (1.0 + 1.0 / 3.0 + 1.0 / 6.0) / 5.0, 1e-12);
}

TEST(Gallery, FifthCountsSixthDoesNot) {
    const std::vector<std::size_t> ranking = {0, 1, 2, 3, 4, 5};
    EXPECT_EQ(evaluateGallery({{ranking, {4}}}, 6)->hitAt5, 1.0);
    EXPECT_EQ(evaluateGallery({{ranking, {5}}}, 6)->hitAt5, 0.0);
}

TEST(Gallery, NoQueriesWithAnswersGiveZeros) {
    const auto report = evaluateGallery({{{0, 1}, {}}}, 2);
    ASSERT_TRUE(report);
    EXPECT_EQ(report->queries, 0U);
    EXPECT_EQ(report->withoutRightAnswer, 1U);
    EXPECT_EQ(report->hitAt1, 0.0);
    EXPECT_EQ(report->meanReciprocalRank, 0.0);
    EXPECT_TRUE(evaluateGallery({}, 0));
}

TEST(Gallery, RefusesIndicesOutsideAndRepeated) {
    const auto expectRefused = [](const GalleryQuery& query, const std::string& part) {
        const auto report = evaluateGallery({{{0}, {0}}, query}, 3);
        ASSERT_FALSE(report);
        EXPECT_EQ(report.error().code, ErrorCode::kInvalidArgument);
        EXPECT_NE(report.error().message.find("query 1"), std::string::npos) << report.error().message;
        EXPECT_NE(report.error().message.find(part), std::string::npos) << report.error().message;
    };
    expectRefused({{0, 3}, {0}}, "entry 3 of a gallery of 3");
    expectRefused({{2, 1, 2}, {0}}, "entry 2 twice");
    expectRefused({{0}, {7}}, "right answer 7");
}

}  // namespace
}  // namespace shapedb
