// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/search/verify.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <map>
#include <memory>
#include <vector>

#include <gtest/gtest.h>
#include <tbb/task_arena.h>

#include "core/geometry/motion.h"
#include "core/matching/score.h"
#include "core/pipeline.h"
#include "core/synthetic/degrade.h"
#include "core/synthetic/families.h"
#include "core/views/views.h"

namespace shapedb {
namespace {

struct Scanned {
    Signature signature;
    std::shared_ptr<const SurfacePoints> surface;
};

PointCloud scanOfFamily(const std::string& family, std::size_t member, std::uint64_t seed) {
    ScanOptions options;
    options.count = 2500;
    options.noise = 0.002;
    options.seed = seed;
    return scanOf(makeMember(family, member, 1).value(), options).value();
}

Scanned scanned(const PointCloud& points) {
    return {describe(points, parametersOf(Profile::kDefault)).value().signature,
            std::make_shared<const SurfacePoints>(makeSurfacePoints(points).value())};
}

// Shapes with ids 10, 20, ..., the last of which has no surface points; and a second scan of the first.
struct Gallery {
    std::map<std::int64_t, Scanned> shapes;
    SignatureSet set;
    Scanned query;

    std::shared_ptr<const SurfacePoints> surfaceOf(std::int64_t id) const { return shapes.at(id).surface; }
};

const Gallery& gallery() {
    static const Gallery made = [] {
        Gallery g;
        std::vector<IndexEntry> entries;
        for (const char* family : {"hammer", "animal", "airplane", "table"}) {
            for (std::size_t member = 0; member < 2; ++member) {
                const auto id = static_cast<std::int64_t>(10 * (g.shapes.size() + 1));
                g.shapes[id] = scanned(scanOfFamily(family, member, 5 + static_cast<std::uint64_t>(id)));
                entries.push_back({id, {}, g.shapes[id].signature});
            }
        }
        g.shapes[80].surface = nullptr;
        g.set = SignatureSet().with(entries, {});
        g.query = scanned(scanOfFamily("hammer", 0, 1));
        return g;
    }();
    return made;
}

const SurfaceOf kStored = [](std::int64_t id) -> Result<std::shared_ptr<const SurfacePoints>> {
    return gallery().surfaceOf(id);
};

Result<VerifiedResult> searched(const Scanned& query, const SearchOptions& options, std::size_t most,
                                const RunContext& context = {}) {
    return topKVerified(query.signature, *query.surface, gallery().set, options, {most}, kStored, context);
}

// Fits everything, one after another, and sorts.
std::vector<VerifiedHit> bruteForce(const Scanned& query, const SearchOptions& options) {
    const QueryTraits traits = traitsOf(query.signature, *query.surface, options.score).value();
    std::vector<VerifiedHit> hits;
    for (const auto& [id, shape] : gallery().shapes) {
        VerifiedHit hit;
        hit.id = id;
        hit.signatureScore = makeScorer(query.signature, options.score)->score(shape.signature);
        double misfit = 1.0;
        if (shape.surface) {
            const FitOptions fitOptions{kindsOfQuery(traits), options.score.keepScale,
                                        options.score.reflection};
            misfit = fit(FitQuery(*query.surface), *shape.surface, fitOptions).value().misfit;
        }
        hit.score = verifiedScore(hit.signatureScore, misfit, misfitShare(traits, options.score));
        if (hit.score >= options.threshold) hits.push_back(hit);
    }
    std::sort(hits.begin(), hits.end(), [](const VerifiedHit& a, const VerifiedHit& b) {
        return a.score != b.score ? a.score > b.score : a.id < b.id;
    });
    if (hits.size() > options.k) hits.resize(options.k);
    return hits;
}

void expectSame(const std::vector<VerifiedHit>& hits, const std::vector<VerifiedHit>& expected) {
    ASSERT_EQ(hits.size(), expected.size());
    for (std::size_t i = 0; i < hits.size(); ++i) {
        EXPECT_EQ(hits[i].id, expected[i].id) << i;
        EXPECT_EQ(hits[i].score, expected[i].score) << i;
        EXPECT_EQ(hits[i].signatureScore, expected[i].signatureScore) << i;
    }
}

TEST(Verify, EqualsBruteForceBitForBit) {
    for (const std::size_t k : {1, 3, 20}) {
        for (const double threshold : {0.0, 0.3}) {
            SearchOptions options;
            options.k = k;
            options.threshold = threshold;
            const auto result = searched(gallery().query, options, 100);
            ASSERT_TRUE(result) << result.error().message;
            EXPECT_TRUE(result->exact);
            expectSame(result->hits, bruteForce(gallery().query, options));
        }
    }
}

TEST(Verify, DoesNotDependOnTheNumberOfThreads) {
    SearchOptions options;
    options.k = 8;
    const auto wide = searched(gallery().query, options, 100);
    tbb::task_arena alone(1);
    const auto narrow = alone.execute([&] { return searched(gallery().query, options, 100); });
    ASSERT_TRUE(wide);
    ASSERT_TRUE(narrow);
    expectSame(wide->hits, narrow->hits);
    EXPECT_EQ(wide->verified, narrow->verified);
}

TEST(Verify, PutsTheSameObjectFirstAndSaysHowItLies) {
    SearchOptions options;
    options.k = 3;
    const auto result = searched(gallery().query, options, 100);
    ASSERT_TRUE(result);
    const VerifiedHit& first = result->hits.front();
    EXPECT_EQ(first.id, 10);
    EXPECT_GT(first.score, 0.9);
    ASSERT_TRUE(first.fit);
    EXPECT_GT(first.fit->best.explainedQuery, 0.9);
    EXPECT_EQ(result->misfitShare, 0.5);
}

TEST(Verify, MeasuresPairsOfPartsUnderTheMotionOfTheFit) {
    const Scanned& query = gallery().query;
    const Scanned& same = gallery().shapes.at(10);
    const auto found =
        explainVerified(query.signature, query.surface.get(), same.signature, same.surface.get(), {});
    ASSERT_TRUE(found);
    EXPECT_EQ(found->verdict, Verdict::kSameObject);
    ASSERT_TRUE(found->fit);
    ASSERT_FALSE(found->explanation.matches.empty());
    for (const PointMatch& match : found->explanation.matches) {
        const Point3 there = apply(found->fit->best.motion, pointPosition(same.signature, match.b));
        EXPECT_EQ(match.distance,
                  length(pointPosition(query.signature, match.a) - there) / query.signature.scale);
    }
    EXPECT_LT(found->explanation.matches.front().distance, 0.05);
}

TEST(Verify, NamesAnAnswerThatTheCapMadeInexact) {
    SearchOptions options;
    options.k = 8;
    const auto capped = searched(gallery().query, options, 2);
    ASSERT_TRUE(capped);
    EXPECT_EQ(capped->verified, 2u);
    EXPECT_FALSE(capped->exact);
    ASSERT_EQ(capped->hits.size(), 8u) << "the others are ranked by their signatures";
    for (const VerifiedHit& hit : capped->hits) {
        if (hit.fit) continue;
        EXPECT_EQ(hit.score,
                  verifiedScore(hit.signatureScore, 1.0, misfitShare(QueryTraits(), options.score)));
    }
}

TEST(Verify, LeavesShapesWithoutSurfacePointsUnverified) {
    SearchOptions options;
    options.k = 8;
    const auto result = searched(gallery().query, options, 100);
    ASSERT_TRUE(result);
    EXPECT_EQ(result->verified, 7u);
    for (const VerifiedHit& hit : result->hits) EXPECT_EQ(hit.fit != nullptr, hit.id != 80) << hit.id;
}

TEST(Verify, KeepsAScoreOfOneForTheSameSignature) {
    SearchOptions options;
    options.k = 2;
    const auto result = searched(gallery().shapes.at(30), options, 100);
    ASSERT_TRUE(result);
    EXPECT_EQ(result->hits.front().id, 30);
    EXPECT_EQ(result->hits.front().score, 1.0);
    EXPECT_LT(result->hits.back().score, 1.0);
    options.excludeId = 30;
    EXPECT_NE(searched(gallery().shapes.at(30), options, 100)->hits.front().id, 30);
}

TEST(Verify, ScoreFallsWithTheMisfitAndRisesWithTheSignatures) {
    for (const QueryTraits traits : {QueryTraits{true, false}, QueryTraits{false, true}}) {
        const double share = misfitShare(traits, {});
        double last = 1.0;
        for (const double misfit : {0.0, 0.2, 0.5, 1.0, 1.4}) {
            const double score = verifiedScore(0.6, misfit, share);
            EXPECT_LT(score, last);
            EXPECT_NEAR(score, scoreOfDistance((1.0 - share) * distanceOfScore(0.6) + share * misfit), 1e-12);
            EXPECT_GT(verifiedScore(0.7, misfit, share), score);
            last = score;
        }
        EXPECT_LT(verifiedScore(0.999999, 0.0, share), 1.0) << "1 is for the same shape alone";
    }
    ScoreOptions handed;
    handed.reflection = false;
    EXPECT_GT(misfitShare({}, handed), misfitShare({}, {})) << "signatures do not tell left from right";
}

TEST(Verify, KnowsScansOfOneSide) {
    const Scanned open = scanned(seenFrom(scanOfFamily("animal", 1, 9), {0, 0, 1}));
    const QueryTraits judged = traitsOf(open.signature, *open.surface).value();
    EXPECT_FALSE(judged.reliable);
    EXPECT_TRUE(judged.ofOneSide);
    const Scanned& whole = gallery().query;
    EXPECT_TRUE(traitsOf(whole.signature, *whole.surface)->reliable);
    EXPECT_FALSE(traitsOf(whole.signature, *whole.surface)->ofOneSide);
    // What the caller knows counts.
    EXPECT_FALSE(traitsOf(open.signature, *open.surface, {}, false)->ofOneSide);
    EXPECT_FALSE(traitsOf(open.signature, *open.surface, {}, false)->reliable);
    EXPECT_TRUE(traitsOf(whole.signature, *whole.surface, {}, true)->ofOneSide);
    EXPECT_TRUE(kindsOfQuery(judged).oneSided);
    EXPECT_FALSE(kindsOfQuery(QueryTraits()).oneSided);
    EXPECT_TRUE(kindsOfQuery(QueryTraits()).piece);
}

TEST(Verify, BelievesTheFitOfAPieceMostAndLooksFurther) {
    ScoreOptions partial;
    partial.partial = true;
    // Half of a shape: most of it is seen from one place, but it is not a scan of one side.
    const Scanned half = scanned(cutBelow(scanOfFamily("animal", 1, 9), {0, 0, 1}, 0.5));
    const QueryTraits piece = traitsOf(half.signature, *half.surface, partial).value();
    EXPECT_TRUE(piece.piece);
    EXPECT_FALSE(piece.ofOneSide);
    EXPECT_FALSE(kindsOfQuery(piece).oneSided);
    EXPECT_TRUE(kindsOfQuery(traitsOf(half.signature, *half.surface, partial, true).value()).oneSided);
    EXPECT_GT(misfitShare(piece, partial), misfitShare({false, true, false}, {}));
    EXPECT_GT(candidatesFor(piece), candidatesFor({false, true, false}));
    EXPECT_GT(candidatesFor({false, true, false}), candidatesFor({}));

    SearchOptions options;
    options.score = partial;
    const auto found = searched(half, options, 100);
    ASSERT_TRUE(found) << found.error().message;
    expectSame(found->hits, bruteForce(half, options));
}

TEST(Verify, EndsWithTheErrorOfASurfaceOrTheContext) {
    SearchOptions options;
    const auto broken =
        topKVerified(gallery().query.signature, *gallery().query.surface, gallery().set, options, {},
                     [](std::int64_t) -> Result<std::shared_ptr<const SurfacePoints>> {
                         return fail(ErrorCode::kDataLoss, "damaged");
                     });
    ASSERT_FALSE(broken);
    EXPECT_EQ(broken.error().code, ErrorCode::kDataLoss);

    std::atomic<bool> cancel{false};
    RunContext context;
    context.cancel = &cancel;
    context.progress = [&](const char* stage, std::uint64_t, std::uint64_t) {
        if (std::string(stage) == "verify") cancel = true;
    };
    const auto cancelled = searched(gallery().query, options, 100, context);
    ASSERT_FALSE(cancelled);
    EXPECT_EQ(cancelled.error().code, ErrorCode::kCancelled);

    options.k = 0;
    EXPECT_EQ(searched(gallery().query, options, 100).error().code, ErrorCode::kInvalidArgument);
}

TEST(Verify, TakesTheCandidatesOfAScanOfOneSideFromItsViews) {
    // Signatures that rank the right shape last: only its views can bring it among four candidates.
    std::vector<IndexEntry> entries;
    const PointCloud whole = scanOfFamily("animal", 1, 9);
    const Scanned open = scanned(seenFrom(whole, {0, 0, 1}));
    for (const auto& [id, shape] : gallery().shapes) {
        IndexEntry entry{id, {}, id == 30 ? gallery().query.signature : open.signature};
        const auto views = makeViews(*gallery().shapes.at(id == 80 ? 70 : id).surface, {});
        entry.views = std::make_shared<const ShapeViews>(views.value());
        if (id == 30) {
            const SurfacePoints surface = makeSurfacePoints(whole).value();
            entry.views = std::make_shared<const ShapeViews>(makeViews(surface, whole).value());
        }
        entries.push_back(std::move(entry));
    }
    const SignatureSet set = SignatureSet().with(entries, {});
    const auto verifiedOf = [&](const VerifyOptions& verify) {
        std::vector<std::int64_t> ids;
        SearchOptions options;
        options.k = 8;
        const auto found = topKVerified(open.signature, *open.surface, set, options, verify, kStored);
        EXPECT_TRUE(found);
        EXPECT_EQ(found->hits.size(), 8u);
        for (const VerifiedHit& hit : found->hits) {
            if (hit.fit) ids.push_back(hit.id);
        }
        std::sort(ids.begin(), ids.end());
        return ids;
    };
    EXPECT_EQ(verifiedOf({4, false, {}}), (std::vector<std::int64_t>{10, 20, 40, 50})) << "by signature";
    for (const VerifyOptions& verify : {VerifyOptions{4, {}, {}}, VerifyOptions{4, true, Point3{0, 0, 9}}}) {
        const auto ids = verifiedOf(verify);
        ASSERT_EQ(ids.size(), 4u);
        EXPECT_EQ(ids.front(), 10) << "the first by signature stays";
        EXPECT_EQ(std::count(ids.begin(), ids.end(), 30), 1) << "by its views";
    }
}

TEST(ScoreScale, DistanceAndScoreAreInverse) {
    EXPECT_EQ(scoreOfDistance(0.0), 1.0);
    EXPECT_NEAR(scoreOfDistance(1.0), 0.2, 1e-15);
    for (const double score : {1.0, 0.9, 0.5, 0.2, 1e-6}) {
        EXPECT_NEAR(scoreOfDistance(distanceOfScore(score)), score, 1e-12);
    }
    EXPECT_TRUE(std::isinf(distanceOfScore(0.0)));
}

}  // namespace
}  // namespace shapedb
