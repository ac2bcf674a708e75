// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/matching/attributed/attributed_scorer.h"

#include <array>
#include <cmath>
#include <functional>
#include <iostream>

#include <gtest/gtest.h>

#include "core/matching/score.h"
#include "core/signature/signature_codec.h"
#include "tests/core/matching/attributed_signatures.h"
#include "tests/core/matching/random_signatures.h"

namespace shapedb {
namespace {

using testing_support::AttributedPair;
using testing_support::describeSignature;
using testing_support::everyOption;
using testing_support::expectFiniteScores;
using testing_support::expectSoundScore;
using testing_support::makeExtreme;
using testing_support::randomAttributed;
using testing_support::randomReflection;
using testing_support::randomSizedPair;
using testing_support::sameBits;
using testing_support::scannedFamilies;
using testing_support::scoreOptions;
using testing_support::turnedAttributed;

TEST(AttributedScore, IsSymmetricAndBoundedOnRandomPairs) {
    Random random(1);
    for (int round = 0; round < 4000; ++round) {
        const AttributedPair pair = randomSizedPair(random);
        const double width = round % 4 == 0 ? std::pow(10.0, random.uniform(-6, 2)) : 0.1;
        for (const ScoreOptions& options : everyOption(width)) expectSoundScore(pair.a, pair.b, options);
        if (HasFatalFailure()) {
            FAIL() << "width " << width << "\n"
                   << describeSignature(pair.a) << "\n"
                   << describeSignature(pair.b);
        }
    }
}

TEST(AttributedScore, IsSymmetricAndBoundedOnScans) {
    const auto& scans = scannedFamilies(1, 1);
    double score0 = 0.0;
    double bound0 = 0.0;
    // Each pair once: expectSoundScore compares both orders.
    for (std::size_t i = 0; i < scans.size(); ++i) {
        for (std::size_t k = 0; k <= i; ++k) {
            const auto& x = scans[i];
            const auto& y = scans[k];
            for (const ScoreOptions& options : everyOption())
                expectSoundScore(x.signature, y.signature, options);
            expectSoundScore(x.signature, y.signature, scoreOptions(true, false, 0.02));
            if (HasFatalFailure()) FAIL() << x.family << " " << y.family;
            if (i == k) continue;
            score0 += score(x.signature, y.signature, {});
            bound0 += scoreUpperBound(x.signature, y.signature, {});
        }
    }
    const double pairs = static_cast<double>(scans.size() * (scans.size() - 1) / 2);
    std::cout << "different shapes: mean score " << score0 / pairs << ", bound " << bound0 / pairs << "\n";
    EXPECT_LT(bound0 / pairs, score0 / pairs + 0.15) << "tight enough to prune by";
}

TEST(AttributedScore, IsOneOnlyForTheSameShape) {
    Random random(2);
    for (int round = 0; round < 200; ++round) {
        const Signature a = randomAttributed(random);
        Signature elsewhere = a;
        elsewhere.origin = {1, 2, 3};
        elsewhere.volume *= 2;
        for (const ScoreOptions& options : everyOption()) {
            EXPECT_EQ(score(a, a, options), 1.0);
            EXPECT_EQ(score(a, elsewhere, options), 1.0);
            EXPECT_EQ(scoreUpperBound(a, a, options), 1.0);
            EXPECT_EQ(explain(a, a, options).score, 1.0);
        }
        const auto differs = [&](const std::function<void(Signature&)>& change) {
            Signature b = a;
            change(b);
            testing_support::updateBody(b);
            for (const ScoreOptions& options : everyOption()) expectSoundScore(a, b, options);
            EXPECT_LT(score(a, b, {}), 1.0);
            EXPECT_GT(score(a, b, {}), 0.5);
            EXPECT_FALSE(sameShape(a, b));
        };
        differs([](Signature& s) { s.attributes->statistics[17] ^= 1; });
        differs([](Signature& s) { s.attributes->quality ^= 1; });
        differs([](Signature& s) {
            float& share = s.points.front().volumeShare;
            share += share > 0.5f ? -0.01f : 0.01f;
        });
        // As part of a larger whole, whose smaller segments were left out.
        differs([](Signature& s) {
            for (std::size_t i = 0; i < s.points.size(); ++i)
                s.points[i].volumeShare *= i % 2 == 0 ? 0.7f : 0.9f;
        });
        differs([](Signature& s) {
            float& radius = s.points.back().maximumRadius;
            radius = radius > 0.2f ? 0.15f : 0.25f;
        });
    }
}

TEST(AttributedScore, IsTheSameForADecodedSignature) {
    const auto& scans = scannedFamilies(2, 1);
    for (std::size_t i = 1; i < scans.size(); ++i) {
        const Signature& a = scans[i - 1].signature;
        const Signature& b = scans[i].signature;
        const auto again = decodeSignature(encodeSignature(b));
        ASSERT_TRUE(again);
        EXPECT_EQ(score(b, *again, {}), 1.0);
        EXPECT_TRUE(sameBits(score(a, b, {}), score(a, *again, {})));
        EXPECT_TRUE(sameBits(scoreUpperBound(a, b, {}), scoreUpperBound(a, *again, {})));
    }
}

TEST(AttributeScore, DoesNotDependOnThePose) {
    Random random(3);
    const auto& scans = scannedFamilies(2, 1);
    for (std::size_t i = 0; i < scans.size(); i += 3) {
        const Signature& a = scans[i].signature;
        const Signature turned = turnedAttributed(a, randomRotation(random));
        EXPECT_GT(score(a, turned, scoreOptions(false, false)), 0.97) << scans[i].family;
        const Signature mirrored = turnedAttributed(a, randomReflection(random));
        EXPECT_GT(score(a, mirrored, {}), 0.97) << scans[i].family;
    }
}

TEST(AttributeScore, TellsLeftFromRightOnlyWithoutReflection) {
    Signature chiral = testing_support::signatureOf(
        {{0, 0, 0, 0.05}, {0.45, 0, 0, 0.021}, {0, 0.3, 0, 0.02}, {0.1, 0, 0.25, 0.019}});
    chiral.attributes.emplace();
    testing_support::updateBody(chiral);
    Random random(4);
    const Signature other = turnedAttributed(chiral, randomReflection(random));
    EXPECT_GT(score(chiral, other, scoreOptions(true, false)), 0.9999);
    EXPECT_LT(score(chiral, other, scoreOptions(false, false)),
              score(chiral, other, scoreOptions(true, false)) - 1e-3);
    for (int round = 0; round < 1000; ++round) {
        const AttributedPair pair = randomSizedPair(random);
        EXPECT_GE(score(pair.a, pair.b, scoreOptions(true, false)),
                  score(pair.a, pair.b, scoreOptions(false, false)));
    }
}

TEST(AttributeScore, KeepScaleComparesSizes) {
    Random random(5);
    for (int round = 0; round < 200; ++round) {
        const AttributedPair pair = randomSizedPair(random);
        Signature b = pair.b;
        b.scale = pair.a.scale;
        const double sameSize = score(pair.a, b, scoreOptions(true, true));
        EXPECT_TRUE(sameBits(sameSize, score(pair.a, b, scoreOptions(true, false))));
        double before = sameSize;
        for (const double factor : {1.1, 1.5, 2.0, 8.0, 1e6}) {
            b.scale = pair.a.scale * factor;
            const double kept = score(pair.a, b, scoreOptions(true, true));
            EXPECT_LT(kept, before) << factor;
            EXPECT_GT(kept, 0.0);
            EXPECT_TRUE(sameBits(score(pair.a, b, scoreOptions(true, false)), sameSize))
                << "sizes do not count";
            Signature smaller = b;
            smaller.scale = pair.a.scale / factor;
            EXPECT_NEAR(score(pair.a, smaller, scoreOptions(true, true)), kept, 1e-9) << "either way";
            before = kept;
        }
    }
}

TEST(AttributedScore, ComparesPointsAndWeightsIfOneSideHasNoAttributes) {
    Random random(12);
    for (int round = 0; round < 200; ++round) {
        const AttributedPair pair = randomSizedPair(random);
        Signature plainA = pair.a;
        Signature plainB = pair.b;
        plainA.attributes.reset();
        plainB.attributes.reset();
        for (const ScoreOptions& options : everyOption()) {
            // Except that shapes of different kinds are never the same.
            if (sameShape(plainA, plainB)) continue;
            const double plain = score(plainA, plainB, options);
            EXPECT_TRUE(sameBits(score(pair.a, plainB, options), plain));
            EXPECT_TRUE(sameBits(score(plainA, pair.b, options), plain));
            EXPECT_TRUE(sameBits(score(plainB, pair.a, options), plain));
            EXPECT_GE(scoreUpperBound(pair.a, plainB, options), plain);
            const Explanation why = explain(pair.a, plainB, options);
            EXPECT_TRUE(sameBits(why.score, plain));
            EXPECT_TRUE(why.terms.empty());
        }
    }
}

TEST(AttributedScore, SinglePointShapesAreSymmetricAndBounded) {
    testing_support::forSinglePointPairs(expectSoundScore);
}

TEST(AttributedScore, StaysFiniteForExtremeNumbers) {
    Random random(14);
    for (int round = 0; round < 1000; ++round) {
        const auto extreme = [&] {
            Signature s = randomAttributed(random, 5);
            const float length = makeExtreme(s, random, 1e18);
            for (WeightedPoint& p : s.points) {
                for (float& x : p.covariance) x *= length * length;
            }
            if (!s.points.empty()) testing_support::updateBody(s);
            return s;
        };
        const Signature a = extreme();
        const Signature b = extreme();
        if (a.points.empty() || b.points.empty()) continue;
        expectFiniteScores(a, b);
    }
}

// The purpose of it all: a second, noisy scan is nearest to its own family.
TEST(AttributedScore, NearestScanIsOfTheSameFamily) {
    const auto& scans = scannedFamilies(2, 2);
    std::size_t sameShapeFirst = 0;
    std::size_t sameFamilyFirst = 0;
    for (const auto& query : scans) {
        const testing_support::Scan* best = nullptr;
        double most = -1.0;
        for (const auto& other : scans) {
            if (&other == &query) continue;
            const double value = score(query.signature, other.signature, {});
            if (value > most) {
                most = value;
                best = &other;
            }
        }
        sameFamilyFirst += best->family == query.family ? 1 : 0;
        sameShapeFirst += best->family == query.family && best->member == query.member ? 1 : 0;
    }
    const double n = static_cast<double>(scans.size());
    std::cout << "nearest scan: same family " << sameFamilyFirst / n << ", same shape " << sameShapeFirst / n
              << "\n";
    EXPECT_GE(sameFamilyFirst / n, 0.9);
    EXPECT_GE(sameShapeFirst / n, 0.8);
}

}  // namespace
}  // namespace shapedb
