// SPDX-License-Identifier: GPL-3.0-or-later
// Scorers through their interface: rows of a block, signatures and free functions agree, and what a scan
// hands on changes no bit.
#include "core/matching/scorer.h"

#include <algorithm>
#include <atomic>

#include <gtest/gtest.h>
#include <tbb/parallel_for.h>

#include "core/matching/score.h"
#include "core/search/signature_block.h"
#include "tests/core/matching/attributed_signatures.h"
#include "tests/core/matching/plain_score.h"
#include "tests/core/matching/random_signatures.h"

namespace shapedb {
namespace {

using testing_support::disturbed;
using testing_support::disturbedAttributed;
using testing_support::plainScore;
using testing_support::randomAttributed;
using testing_support::randomSignature;
using testing_support::sameBits;

std::vector<ScoreOptions> everyMode() {
    std::vector<ScoreOptions> modes;
    for (ScoreOptions options : testing_support::everyOption()) {
        for (const bool partial : {false, true}) {
            options.partial = partial;
            modes.push_back(options);
        }
    }
    return modes;
}

// Shapes near the query and far from it, the query itself, and some of the other kind.
std::vector<Signature> shapesFor(const Signature& query, Random& random, std::size_t count) {
    std::vector<Signature> shapes{query};
    while (shapes.size() < count) {
        const double noise = random.uniform(0, 0.1);
        switch (random.below(4)) {
            case 0: shapes.push_back(randomSignature(random, 7)); break;
            case 1:
                shapes.push_back(query.attributes ? randomAttributed(random) : randomSignature(random, 7));
                break;
            default:
                shapes.push_back(query.attributes ? disturbedAttributed(query, random, noise)
                                                  : disturbed(query, random, noise));
        }
        if (random.below(3) == 0) shapes.back().scale *= random.uniform(0.7, 1.4);
    }
    return shapes;
}

SignatureBlock blockOf(const std::vector<Signature>& shapes) {
    SignatureBlock block;
    std::int64_t id = 0;
    for (const Signature& shape : shapes) block.append({++id, {}, shape});
    return block;
}

void expectRowsAgreeWithSignatures(const Signature& query, Random& random) {
    const std::vector<Signature> shapes = shapesFor(query, random, 40);
    const SignatureBlock block = blockOf(shapes);
    const ShapeRows rows = block.rows();
    for (const ScoreOptions& options : everyMode()) {
        const auto scorer = makeScorer(query, options);
        for (std::size_t i = 0; i < shapes.size(); ++i) {
            ASSERT_TRUE(scorer->compares(rows[i]));
            const double value = scorer->score(rows[i]);
            ASSERT_TRUE(sameBits(value, scorer->score(shapes[i])));
            ASSERT_TRUE(sameBits(value, score(query, shapes[i], options)));
            ASSERT_TRUE(sameBits(value, scorer->explain(shapes[i]).score));
            ASSERT_TRUE(sameBits(scorer->bound(rows[i]), scoreUpperBound(query, shapes[i], options)));
            ASSERT_GE(scorer->bound(rows[i]), value);
        }
    }
}

TEST(Scorer, RowsOfABlockScoreAsTheirSignatures) {
    Random random(1);
    for (int round = 0; round < 15; ++round) {
        expectRowsAgreeWithSignatures(randomSignature(random, 7), random);
        expectRowsAgreeWithSignatures(randomAttributed(random), random);
        if (HasFatalFailure()) FAIL() << "round " << round;
    }
}

// Every row that reaches `least` is left, under its own bound, and scores the same when the scan's
// result is handed back.
void expectScanIsExact(const Signature& query, double least, Random& random) {
    const std::vector<Signature> shapes = shapesFor(query, random, 300);
    const SignatureBlock block = blockOf(shapes);
    const ShapeRows rows = block.rows();
    std::vector<std::uint8_t> wanted(shapes.size());
    for (std::uint8_t& row : wanted) row = random.below(4) > 0 ? 1 : 0;
    for (const ScoreOptions& options : everyMode()) {
        const auto scorer = makeScorer(query, options);
        std::vector<Survivor> left;
        ScanCounts counts;
        scorer->scan(rows, wanted, least, left, counts);
        ASSERT_GE(counts.left[1], left.size());
        ASSERT_GE(counts.left[0], counts.left[1]);
        std::vector<bool> isLeft(shapes.size(), false);
        for (const Survivor& survivor : left) {
            ASSERT_EQ(wanted[survivor.row], 1);
            isLeft[survivor.row] = true;
            const double value = scorer->score(rows[survivor.row]);
            ASSERT_GE(survivor.bound, value);
            const auto reached = scorer->scoreIfReaches(rows[survivor.row], survivor, least);
            if (reached) {
                ASSERT_TRUE(sameBits(*reached, value));
            } else {
                ASSERT_LT(value, least);
            }
        }
        for (std::size_t i = 0; i < shapes.size(); ++i) {
            if (wanted[i] == 1 && !isLeft[i]) {
                ASSERT_LT(scorer->score(rows[i]), least);
            }
        }
    }
}

TEST(Scorer, ScanLeavesEveryRowThatReachesAScore) {
    Random random(2);
    for (const double least : {0.0, 0.3, 0.7, 0.95, 1.0}) {
        expectScanIsExact(randomSignature(random, 6), least, random);
        expectScanIsExact(randomAttributed(random), least, random);
        if (HasFatalFailure()) FAIL() << "least " << least;
    }
}

TEST(Scorer, AgreesWithTheDefinitionOfThePublishedScore) {
    Random random(3);
    for (int round = 0; round < 60; ++round) {
        const Signature query = randomSignature(random, testing_support::Kind::kPlain, 6);
        const auto scorer = makeScorer(query, {});
        for (int other = 0; other < 10; ++other) {
            const Signature shape = disturbed(query, random, random.uniform(0, 0.2));
            EXPECT_NEAR(scorer->score(shape), plainScore(query, shape, {}), 1e-9);
        }
    }
}

TEST(Scorer, PublishedScorerLeavesOutRowsWithoutPoints) {
    Random random(4);
    const auto scorer = makeScorer(randomSignature(random, 6), {});
    const SignatureBlock block = blockOf({randomAttributed(random), randomSignature(random, 6)});
    EXPECT_FALSE(scorer->compares(block.rows()[0]));
    std::vector<Survivor> left;
    ScanCounts counts;
    scorer->scan(block.rows(), {}, 0.0, left, counts);
    ASSERT_EQ(left.size(), 1u);
    EXPECT_EQ(left[0].row, 1u);
    EXPECT_EQ(counts.left.back(), 1u);
}

TEST(Scorer, MayBeSharedByThreads) {
    Random random(5);
    const Signature query = randomAttributed(random);
    const SignatureBlock block = blockOf(shapesFor(query, random, 200));
    const auto scanned = [&](const Scorer& scorer) {
        std::vector<Survivor> left;
        ScanCounts counts;
        scorer.scan(block.rows(), {}, 0.4, left, counts);
        double sum = 0.0;
        for (const Survivor& s : left) {
            sum += scorer.scoreIfReaches(block.rows()[s.row], s, 0.4).value_or(0.0);
        }
        return sum;
    };
    const double expected = scanned(*makeScorer(query, {}));
    const auto shared = makeScorer(query, {});
    std::atomic<int> different{0};
    tbb::parallel_for(0, 64, [&](int) { different += sameBits(scanned(*shared), expected) ? 0 : 1; });
    EXPECT_EQ(different, 0);
}

TEST(ShapeRow, CanonicalOrderIsStrictAndSeesWhatIsScored) {
    Random random(6);
    for (int round = 0; round < 300; ++round) {
        const Signature a = round % 2 == 0 ? randomAttributed(random) : randomSignature(random, 6);
        Signature b = a;
        if (b.attributes) {
            b.attributes->statistics[random.below(kStatisticBins)] ^= 1;
        } else {
            b.points.back().weight *= 0.5f;
        }
        const PackedShape x(a);
        const PackedShape y(b);
        EXPECT_TRUE(sameShape(x.row(), x.row(), true));
        EXPECT_FALSE(sameShape(x.row(), y.row()));
        EXPECT_FALSE(canonicalLess(x.row(), x.row()));
        EXPECT_NE(canonicalLess(x.row(), y.row()), canonicalLess(y.row(), x.row()));
        Signature larger = a;
        larger.scale *= 2.0;
        const PackedShape z(larger);
        EXPECT_TRUE(sameShape(x.row(), z.row()));
        EXPECT_FALSE(sameShape(x.row(), z.row(), true));
    }
}

}  // namespace
}  // namespace shapedb
