// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/matching/score.h"

#include <chrono>
#include <cmath>
#include <iostream>
#include <limits>

#include <gtest/gtest.h>

#include "core/matching/published/published_scorer.h"
#include "tests/core/matching/plain_score.h"
#include "tests/core/matching/random_signatures.h"

namespace shapedb {
namespace {

using testing_support::describeSignature;
using testing_support::disturbed;
using testing_support::everyOption;
using testing_support::expectFiniteScores;
using testing_support::Kind;
using testing_support::kKindCount;
using testing_support::makeExtreme;
using testing_support::Matching;
using testing_support::plainScore;
using testing_support::randomReflection;
using testing_support::randomSignature;
using testing_support::sameBits;
using testing_support::scoreOptions;
using testing_support::signatureOf;
using testing_support::turned;

ScoreOptions randomOptions(Random& random) {
    ScoreOptions options;
    options.reflection = random.below(2) == 1;
    options.keepScale = random.below(2) == 1;
    if (random.below(2) == 1) options.kernelWidth = std::pow(10.0, random.uniform(-2, 0.5));
    return options;
}

// Unrelated, related, or the same in another pose: the whole range of scores.
struct Pair {
    Signature a, b;
};

Pair randomPair(Random& random, std::size_t maxPoints = 8) {
    Pair pair;
    pair.a = randomSignature(random, maxPoints);
    switch (random.below(4)) {
        case 0: pair.b = disturbed(pair.a, random, std::pow(10.0, random.uniform(-6, -1))); break;
        case 1: pair.b = turned(disturbed(pair.a, random, 0.03), randomRotation(random)); break;
        case 2: pair.b = turned(disturbed(pair.a, random, 0.03), randomReflection(random)); break;
        default: pair.b = randomSignature(random, maxPoints);
    }
    if (random.below(3) == 0) pair.b.scale = pair.a.scale * random.uniform(0.7, 1.4);
    return pair;
}

// All points within what counts as no direction from one line: the roll is free, and which one is
// taken moves points by that much.
bool onALine(const Signature& signature) {
    Point3 farthest;
    for (const WeightedPoint& p : signature.points) {
        const Point3 at{p.position[0], p.position[1], p.position[2]};
        if (length(at) > length(farthest)) farthest = at;
    }
    for (const WeightedPoint& p : signature.points) {
        const Point3 at{p.position[0], p.position[1], p.position[2]};
        if (length(cross(at, farthest)) > 1e-6 * length(farthest)) return false;
    }
    return true;
}

TEST(Score, AgreesWithItsDefinition) {
    Random random(1);
    for (int round = 0; round < 2500; ++round) {
        const Pair pair = randomPair(random, round % 5 == 0 ? 8 : 6);
        const ScoreOptions options = randomOptions(random);
        const double fast = score(pair.a, pair.b, options);
        const double plain = plainScore(pair.a, pair.b, options);
        const bool free = onALine(pair.a) || onALine(pair.b);
        EXPECT_NEAR(fast, plain, free ? 1e-6 / options.kernelWidth : 1e-9)
            << "reflection " << options.reflection << " keepScale " << options.keepScale << " width "
            << options.kernelWidth << "\n"
            << describeSignature(pair.a) << "\n"
            << describeSignature(pair.b);
    }
}

TEST(Score, GreedyMatchingLosesLittleAgainstTheOptimum) {
    Random random(2);
    double worst = 0.0;
    double sum = 0.0;
    int differing = 0;
    const int rounds = 400;
    for (int round = 0; round < rounds; ++round) {
        const Pair pair = randomPair(random, 6);
        const double greedy = plainScore(pair.a, pair.b, {}, Matching::kGreedy);
        const double optimal = plainScore(pair.a, pair.b, {}, Matching::kOptimal);
        EXPECT_GE(optimal, greedy - 1e-12);
        worst = std::max(worst, optimal - greedy);
        sum += optimal - greedy;
        differing += optimal - greedy > 1e-9 ? 1 : 0;
    }
    std::cout << "optimal over greedy: mean " << sum / rounds << ", worst " << worst << ", " << differing
              << " of " << rounds << " pairs differ\n";
    // A greedy one-to-one matching has at least half the optimal sum; in scores it is far closer.
    EXPECT_LT(sum / rounds, 0.01);
    EXPECT_LT(worst, 0.2);
}

TEST(Score, IsBetweenZeroAndOneAndSymmetricBitForBit) {
    Random random(3);
    for (int round = 0; round < 5000; ++round) {
        const Pair pair = randomPair(random);
        const ScoreOptions options = randomOptions(random);
        const double value = score(pair.a, pair.b, options);
        EXPECT_GE(value, 0.0);
        EXPECT_LE(value, 1.0);
        EXPECT_TRUE(sameBits(value, score(pair.b, pair.a, options))) << describeSignature(pair.a);
        EXPECT_TRUE(sameBits(value, score(pair.a, pair.b, options)));
    }
}

TEST(Score, IsExactlyOneForTheSameSignature) {
    Random random(4);
    for (int kind = 0; kind < kKindCount; ++kind) {
        for (int round = 0; round < 100; ++round) {
            const Signature a = randomSignature(random, static_cast<Kind>(kind), kMaxSignaturePoints);
            Signature elsewhere = a;
            elsewhere.origin = {1, 2, 3};
            elsewhere.volume *= 2;
            for (const ScoreOptions& options : everyOption()) {
                EXPECT_EQ(score(a, a, options), 1.0);
                EXPECT_EQ(score(a, elsewhere, options), 1.0);
            }
        }
    }
}

TEST(Score, IsOneForARotatedCopyUpToSinglePrecision) {
    Random random(5);
    for (int round = 0; round < 1500; ++round) {
        // turned() keeps the order of the points, hence the anchor, even where weights are equal.
        const Signature a = randomSignature(random);
        if (a.points.size() == 1) continue;
        const Signature rotated = turned(a, randomRotation(random));
        const Signature mirrored = turned(a, randomReflection(random));
        for (const ScoreOptions& options : everyOption()) {
            EXPECT_GE(score(a, rotated, options), 1.0 - 1e-5) << describeSignature(a);
            if (options.reflection) {
                EXPECT_GE(score(a, mirrored, options), 1.0 - 1e-5) << describeSignature(a);
            }
        }
    }
}

TEST(Score, DoesNotDependOnThePoses) {
    Random random(6);
    for (int round = 0; round < 1500; ++round) {
        const Signature a = randomSignature(random, Kind::kPlain, 7);
        const Signature b =
            round % 2 == 0 ? disturbed(a, random, 0.05) : randomSignature(random, Kind::kPlain, 7);
        for (const ScoreOptions& options : everyOption()) {
            EXPECT_NEAR(score(a, b, options), score(a, turned(b, randomRotation(random)), options), 1e-5)
                << describeSignature(a) << "\n"
                << describeSignature(b);
        }
    }
}

TEST(Score, TellsLeftFromRightOnlyWithoutReflection) {
    // Arms of different lengths and weights along three axes: no plane of symmetry.
    const Signature chiral = signatureOf(
        {{0, 0, 0, 0.05}, {0.45, 0, 0, 0.02}, {0, 0.35, 0, 0.02}, {0, 0, 0.25, 0.02}, {0.45, 0.1, 0, 0.02}});
    const Matrix3 mirror = {{{1, 0, 0}, {0, 1, 0}, {0, 0, -1}}};
    const Signature other = turned(chiral, mirror);
    EXPECT_GE(score(chiral, other, scoreOptions(true, false, 0.1)), 1.0 - 1e-5);
    EXPECT_LT(score(chiral, other, scoreOptions(false, false, 0.1)), 0.95);
    EXPECT_LT(score(chiral, other, scoreOptions(false, false, 0.05)), 0.9);

    Random random(7);
    int clearlyBelow = 0;
    for (int round = 0; round < 200; ++round) {
        Signature shape = randomSignature(random, Kind::kEqualWeight, 7);
        while (shape.points.size() < 6) shape = randomSignature(random, Kind::kEqualWeight, 7);
        const Signature copy = turned(shape, randomReflection(random));
        const double without = score(shape, copy, scoreOptions(false, false, 0.05));
        const double with = score(shape, copy, scoreOptions(true, false, 0.05));
        EXPECT_LE(without, with);
        clearlyBelow += without < 0.95 ? 1 : 0;
    }
    EXPECT_GT(clearlyBelow, 180);
}

TEST(Score, ReflectionCanOnlyRaiseTheScore) {
    Random random(8);
    for (int round = 0; round < 2000; ++round) {
        const Pair pair = randomPair(random);
        const bool keepScale = round % 2 == 0;
        EXPECT_GE(score(pair.a, pair.b, scoreOptions(true, keepScale, 0.1)),
                  score(pair.a, pair.b, scoreOptions(false, keepScale, 0.1)));
    }
}

TEST(Score, KeepScaleComparesSizes) {
    Random random(9);
    for (int round = 0; round < 300; ++round) {
        const Signature a = randomSignature(random, Kind::kPlain, 7);
        Signature b = a;
        b.scale = a.scale * 2.0;
        EXPECT_EQ(score(a, b, scoreOptions(true, false, 0.1)), 1.0);
        // Every pair has at most the smaller's weight, an eighth of the larger's.
        const double kept = score(a, b, scoreOptions(true, true, 0.1));
        EXPECT_LE(kept, 0.125 + 1e-12);
        EXPECT_GT(kept, 0.0);
        // Only the ratio of sizes matters.
        Signature a10 = a;
        Signature b10 = b;
        a10.scale *= 8.0;
        b10.scale *= 8.0;
        EXPECT_TRUE(sameBits(kept, score(a10, b10, scoreOptions(true, true, 0.1))));
        b.scale = std::nextafter(a.scale, 1e9);
        EXPECT_GE(score(a, b, scoreOptions(true, true, 0.1)),
                  a.points.size() == 1 ? kDegenerateCeiling : 1.0 - 1e-9);
    }
}

TEST(Score, SinglePointScoresAtMostTheCeiling) {
    const Signature ball = signatureOf({{0, 0, 0, 0.1}});
    const Signature almost = signatureOf({{0, 0, 0, 0.1 * (1 + 1e-6)}});
    const Signature half = signatureOf({{0, 0, 0, 0.05}});
    const Signature withArm = signatureOf({{0, 0, 0, 0.1}, {0.4, 0, 0, 1e-9}});
    for (const ScoreOptions& options : everyOption()) {
        EXPECT_EQ(score(ball, ball, options), 1.0);
        EXPECT_EQ(score(ball, almost, options), kDegenerateCeiling);
        EXPECT_EQ(score(ball, withArm, options), kDegenerateCeiling);
        EXPECT_NEAR(score(ball, half, options), 0.5, 1e-6);
        EXPECT_LE(scoreUpperBound(ball, almost, options), kDegenerateCeiling);
    }
    Signature larger = ball;
    larger.scale = 1.01;
    EXPECT_EQ(score(ball, larger, scoreOptions(true, false, 0.1)), 1.0);
    EXPECT_LE(score(ball, larger, scoreOptions(true, true, 0.1)), kDegenerateCeiling);
}

TEST(Score, AgreesWithAnExampleByHand) {
    // Both anchors meet, the arms meet at distance 0.1: kernel (1 - 0.01 / 0.08)^4.
    const Signature a = signatureOf({{0, 0, 0, 0.5}, {0.5, 0, 0, 0.25}});
    const Signature b = signatureOf({{0, 0, 0, 0.5}, {0, 0.6, 0, 0.125}});
    const double similarity = 0.5 + 0.125 * std::pow(0.875, 4.0);
    const double expected = similarity / (0.75 + 0.625 - similarity);
    EXPECT_NEAR(score(a, b, {}), expected, 1e-7);
    const Explanation why = explain(a, b, {});
    EXPECT_NEAR(why.similarity, similarity, 1e-7);
    EXPECT_NEAR(why.dissimilarity, 1.375 - 2.0 * similarity, 1e-7);
}

TEST(Score, RefusesKernelWidthsOutOfRange) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    const double infinite = std::numeric_limits<double>::infinity();
    for (const double width : {0.0, -0.1, -0.0, 1e-7, 1e-200, 2e6, nan, infinite, -infinite}) {
        const auto result = validate(scoreOptions(true, false, width));
        ASSERT_FALSE(result) << width;
        EXPECT_EQ(result.error().code, ErrorCode::kInvalidArgument);
        EXPECT_NE(result.error().message.find("kernel_width"), std::string::npos);
        EXPECT_NE(result.error().message.find("1e-06 to 1e+06"), std::string::npos) << result.error().message;
    }
    for (const double width : {kMinKernelWidth, 0.01, 0.1, 1.0, kMaxKernelWidth}) {
        EXPECT_TRUE(validate(scoreOptions(true, false, width))) << width;
    }
}

TEST(Score, StaysFiniteForExtremeNumbers) {
    Random random(10);
    for (int round = 0; round < 3000; ++round) {
        const auto extreme = [&] {
            Signature s = randomSignature(random, 5);
            makeExtreme(s, random, 1e30);
            return s;
        };
        const Signature a = extreme();
        const Signature b = extreme();
        if (a.points.empty() || b.points.empty()) continue;
        expectFiniteScores(a, b);
    }
}

TEST(ScoreUpperBound, IsNeverBelowTheScore) {
    Random random(11);
    double slack = 0.0;
    double share = 0.0;
    int tight = 0;
    const int rounds = 3000;
    for (int round = 0; round < rounds; ++round) {
        const Pair pair = randomPair(random);
        const double width = round % 4 == 0 ? std::pow(10.0, random.uniform(-6, 1)) : 0.1;
        for (const ScoreOptions& options : everyOption(width)) {
            const double exact = score(pair.a, pair.b, options);
            const double bound = scoreUpperBound(pair.a, pair.b, options);
            ASSERT_GE(bound, exact) << "width " << width << "\n"
                                    << describeSignature(pair.a) << "\n"
                                    << describeSignature(pair.b);
            ASSERT_LE(bound, 1.0);
        }
        const double gap = scoreUpperBound(pair.a, pair.b, {}) - score(pair.a, pair.b, {});
        slack += gap;
        share += score(pair.a, pair.b, {});
        tight += gap < 0.05 ? 1 : 0;
    }
    std::cout << "bound over score: mean " << slack / rounds << " at a mean score of " << share / rounds
              << ", " << 100 * tight / rounds << " % within 0.05\n";
}

TEST(ScoreUpperBound, RulesOutMostUnrelatedShapes) {
    // What pruning lives on: at seven points the bound of unrelated shapes is well below 1.
    Random random(12);
    double sum = 0.0;
    double exact = 0.0;
    for (int round = 0; round < 500; ++round) {
        const Signature a = randomSignature(random, Kind::kPlain, 7);
        const Signature b = randomSignature(random, Kind::kPlain, 7);
        sum += scoreUpperBound(a, b, {});
        exact += score(a, b, {});
    }
    std::cout << "unrelated shapes: bound " << sum / 500 << ", score " << exact / 500 << "\n";
    EXPECT_LT(sum / 500, 0.75);
}

TEST(ScoreUpperBound, IsExactlyOneForTheSameShape) {
    Random random(13);
    for (int round = 0; round < 300; ++round) {
        const Signature a = randomSignature(random);
        for (const ScoreOptions& options : everyOption()) EXPECT_EQ(scoreUpperBound(a, a, options), 1.0);
    }
}

}  // namespace
}  // namespace shapedb
