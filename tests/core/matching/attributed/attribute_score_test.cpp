// The score of signatures with attributes, on random ones and on scans of synthetic families.
#include "core/matching/attributed/attribute_score.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <functional>
#include <iostream>
#include <limits>
#include <set>
#include <string>

#include <gtest/gtest.h>

#include "core/matching/score.h"
#include "core/pipeline.h"
#include "core/signature/signature_codec.h"
#include "core/synthetic/families.h"
#include "tests/core/matching/attributed_signatures.h"
#include "tests/core/matching/random_signatures.h"

namespace shapedb {
namespace {

using testing_support::describeSignature;
using testing_support::disturbedAttributed;
using testing_support::randomAttributed;
using testing_support::randomReflection;
using testing_support::randomSignature;
using testing_support::scannedFamilies;
using testing_support::scoreOptions;
using testing_support::turnedAttributed;

bool sameBits(double x, double y) { return std::memcmp(&x, &y, sizeof x) == 0; }

std::array<ScoreOptions, 4> everyOption(double width = 0.1) {
    return {scoreOptions(true, false, width), scoreOptions(false, false, width),
            scoreOptions(true, true, width), scoreOptions(false, true, width)};
}

struct Pair {
    Signature a, b;
};

Pair randomPair(Random& random) {
    Pair pair;
    pair.a = randomAttributed(random);
    const double noise = std::pow(10.0, random.uniform(-6, -1));
    switch (random.below(4)) {
        case 0: pair.b = disturbedAttributed(pair.a, random, noise); break;
        case 1:
            pair.b = turnedAttributed(disturbedAttributed(pair.a, random, noise), randomRotation(random));
            break;
        case 2:
            pair.b = turnedAttributed(disturbedAttributed(pair.a, random, noise), randomReflection(random));
            break;
        default: pair.b = randomAttributed(random);
    }
    if (random.below(3) == 0) pair.b.scale = pair.a.scale * random.uniform(0.7, 1.4);
    return pair;
}

// Everything that must hold of one pair.
void expectSound(const Signature& a, const Signature& b, const ScoreOptions& options) {
    const double value = score(a, b, options);
    ASSERT_GT(value, 0.0);
    ASSERT_LE(value, 1.0);
    const bool same = sameShape(a, b) && (!options.keepScale || a.scale == b.scale);
    ASSERT_EQ(value == 1.0, same);
    ASSERT_TRUE(sameBits(value, score(b, a, options)));
    const double bound = scoreUpperBound(a, b, options);
    ASSERT_GE(bound, value);
    ASSERT_LE(bound, 1.0);
    ASSERT_GE(scoreUpperBound(b, a, options), value);
}

TEST(AttributeScore, IsSoundOnRandomPairs) {
    Random random(1);
    for (int round = 0; round < 4000; ++round) {
        const Pair pair = randomPair(random);
        const double width = round % 4 == 0 ? std::pow(10.0, random.uniform(-6, 2)) : 0.1;
        for (const ScoreOptions& options : everyOption(width)) expectSound(pair.a, pair.b, options);
        if (HasFatalFailure()) {
            FAIL() << "width " << width << "\n"
                   << describeSignature(pair.a) << "\n"
                   << describeSignature(pair.b);
        }
    }
}

TEST(AttributeScore, IsSoundOnScans) {
    const auto& scans = scannedFamilies(1, 1);
    double score0 = 0.0;
    double bound0 = 0.0;
    for (const auto& x : scans) {
        for (const auto& y : scans) {
            for (const ScoreOptions& options : everyOption()) expectSound(x.signature, y.signature, options);
            expectSound(x.signature, y.signature, scoreOptions(true, false, 0.02));
            if (HasFatalFailure()) FAIL() << x.family << " " << y.family;
            if (&x == &y) continue;
            score0 += score(x.signature, y.signature, {});
            bound0 += scoreUpperBound(x.signature, y.signature, {});
        }
    }
    const double pairs = static_cast<double>(scans.size() * (scans.size() - 1));
    std::cout << "different shapes: mean score " << score0 / pairs << ", bound " << bound0 / pairs << "\n";
    EXPECT_LT(bound0 / pairs, score0 / pairs + 0.15) << "tight enough to prune by";
}

TEST(AttributeScore, IsOneOnlyForTheSame) {
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
            for (const ScoreOptions& options : everyOption()) expectSound(a, b, options);
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
        // Of a larger whole, of which the lesser segments were left out.
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

TEST(AttributeScore, OfADecodedSignatureIsThatOfTheOriginal) {
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
        const Pair pair = randomPair(random);
        EXPECT_GE(score(pair.a, pair.b, scoreOptions(true, false)),
                  score(pair.a, pair.b, scoreOptions(false, false)));
    }
}

TEST(AttributeScore, KeepScaleComparesSizes) {
    Random random(5);
    for (int round = 0; round < 200; ++round) {
        const Pair pair = randomPair(random);
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

TEST(AttributeScore, FallsAsEachStatisticMovesAway) {
    Random random(6);
    for (const StatisticLayout& layout : kStatistics) {
        const Signature a = randomAttributed(random);
        double before = 1.0;
        for (int step = 1; step <= 5; ++step) {
            Signature b = a;
            for (std::size_t i = layout.offset; i < layout.offset + layout.count; ++i) {
                b.attributes->statistics[i] = static_cast<std::uint8_t>(a.attributes->statistics[i] + step);
            }
            const double now = score(a, b, {});
            EXPECT_LT(now, before) << layout.name;
            before = now;
        }
    }
}

TEST(AttributeScore, FollowsFromTheAgreement) {
    Random random(7);
    for (int round = 0; round < 300; ++round) {
        const Pair pair = randomPair(random);
        const AttributeDistance distance = attributeDistance(pair.a, pair.b, {});
        EXPECT_GE(distance.statistics, 0.0);
        EXPECT_GT(distance.totalWeight, distance.partsWeight);
        EXPECT_GT(distance.partsWeight, 0.0);
        double before = 0.0;
        for (const double agreement : {0.0, 0.1, 0.5, 0.9, 1.0}) {
            const double value = attributeScore(distance, agreement);
            EXPECT_GT(value, before) << "rises with the agreement";
            EXPECT_LE(value, 1.0);
            before = value;
        }
        EXPECT_EQ(attributeScore(distance, 1.0), attributeScore(distance, 1.0 + 1e-7))
            << "shares are rounded";
    }
}

// An interior that could not be told has less say: what it says of the thickness weighs less against
// what the surface says, which does not depend on it.
TEST(AttributeScore, TrustsAnInteriorAsMuchAsItDeserves) {
    Random random(8);
    const auto weights = [](const Signature& a, const Signature& b) {
        double interior = 0.0;
        double surface = 0.0;
        const auto terms = scoreTerms(a, b, {}, 0.5);
        for (std::size_t kind = 0; kind < kStatisticKinds; ++kind) {
            (kStatistics[kind].evidence == Evidence::kInside ? interior : surface) += terms[kind].weight;
        }
        interior += terms.back().weight;
        EXPECT_NEAR(interior + surface, 1.0, 1e-12);
        return interior;
    };
    Signature a = randomAttributed(random);
    Signature b = randomAttributed(random);
    double before = 0.0;
    for (const int quality : {0, 60, 120, 180, 255}) {
        a.attributes->quality = static_cast<std::uint8_t>(quality);
        b.attributes->quality = 255;
        const double now = weights(a, b);
        EXPECT_GT(now, 0.0) << "never nothing";
        EXPECT_GE(now, before);
        EXPECT_EQ(now, weights(b, a));
        b.attributes->quality = static_cast<std::uint8_t>(quality);
        EXPECT_EQ(now, weights(a, b)) << "the poorer decides";
        before = now;
    }
    a.attributes->quality = 20;
    b.attributes->quality = 20;
    EXPECT_LT(weights(a, b), before - 0.1);
}

// One side of a surface has the outline of both: it gains what the rest loses.
TEST(AttributeScore, AGuessedInteriorLeavesTheOutlineToDecide) {
    Random random(81);
    Signature a = randomAttributed(random);
    Signature b = randomAttributed(random);
    b.attributes->quality = 255;
    const auto weights = [&](int quality) {
        a.attributes->quality = static_cast<std::uint8_t>(quality);
        std::array<double, 3> sums{};
        const auto terms = scoreTerms(a, b, {}, 0.5);
        for (std::size_t kind = 0; kind < kStatisticKinds; ++kind) {
            sums[static_cast<std::size_t>(kStatistics[kind].evidence)] += terms[kind].weight;
        }
        return sums;
    };
    const auto told = weights(255);
    const auto guessed = weights(0);
    EXPECT_EQ(told, weights(128)) << "a half is trusted in full";
    EXPECT_GT(guessed[2], 4.0 * told[2]);
    EXPECT_LT(guessed[0], 0.02);
    // Surface against outline: 1 to a half when told, a half to 1 when guessed; three kinds to two.
    EXPECT_NEAR(told[1] / told[2], 3.0, 1e-9);
    EXPECT_NEAR(guessed[1] / guessed[2], 0.75, 1e-9);
    // Of a piece, so does what its whole contains of it.
    a.attributes->quality = 255;
    EXPECT_DOUBLE_EQ(pieceTerms(a, b, {}, 0.5, 0.5).back().weight, 0.5);
    a.attributes->quality = 0;
    EXPECT_DOUBLE_EQ(pieceTerms(a, b, {}, 0.5, 0.5).back().weight, 0.25);
}

TEST(AttributeScore, WhichEndOfAnOutlineComesFirstDoesNotCount) {
    Random random(82);
    for (int round = 0; round < 100; ++round) {
        const Pair pair = randomPair(random);
        Signature turned = pair.b;
        for (const StatisticLayout& layout : kStatistics) {
            if (layout.reversibleRows == 0) continue;
            const int columns = layout.count / layout.reversibleRows;
            for (int row = 0; row < layout.reversibleRows; ++row) {
                const auto from = pair.b.attributes->statistics.begin() + layout.offset +
                                  (layout.reversibleRows - 1 - row) * columns;
                std::copy(from, from + columns,
                          turned.attributes->statistics.begin() + layout.offset + row * columns);
            }
        }
        ASSERT_NE(turned.attributes->statistics, pair.b.attributes->statistics);
        if (sameShape(pair.a, pair.b)) continue;
        for (const ScoreOptions& options : everyOption()) {
            EXPECT_TRUE(sameBits(score(pair.a, pair.b, options), score(pair.a, turned, options)));
            expectSound(pair.b, turned, options);
        }
        const auto terms = scoreTerms(pair.b, turned, {}, 1.0);
        for (std::size_t kind = 0; kind < kStatisticKinds; ++kind) EXPECT_EQ(terms[kind].distance, 0.0);
        EXPECT_LT(score(pair.b, turned, {}), 1.0) << "not the same bytes";
    }
}

void expectTermsMakeTheScore(const Signature& a, const Signature& b, const ScoreOptions& options,
                             const Explanation& why) {
    ASSERT_EQ(why.terms.size(), kStatisticKinds + 1);
    double weight = 0.0;
    double mean = 0.0;
    std::set<std::string> names;
    for (const ScoreTerm& term : why.terms) {
        EXPECT_GE(term.distance, 0.0);
        EXPECT_GT(term.weight, 0.0);
        weight += term.weight;
        mean += term.weight * term.distance;
        names.insert(term.name);
    }
    EXPECT_EQ(names.size(), why.terms.size());
    EXPECT_EQ(names.count("parts"), 1U);
    EXPECT_NEAR(weight, 1.0, 1e-12);
    const double octaves = options.keepScale ? std::abs(std::log2(a.scale / b.scale)) : 0.0;
    AttributeDistance asOne;  // the same mean, with nothing left to the parts
    asOne.statistics = mean;
    asOne.totalWeight = 1.0;
    asOne.scale = octaves;
    EXPECT_NEAR(why.score, attributeScore(asOne, 1.0), 1e-9);
}

void expectConsistent(const Signature& a, const Signature& b, const ScoreOptions& options) {
    const Explanation why = explain(a, b, options);
    EXPECT_TRUE(sameBits(why.score, score(a, b, options)));
    if (why.score < 1.0) expectTermsMakeTheScore(a, b, options, why);
    EXPECT_NEAR(determinant(why.motion.rotation), why.motion.reflected ? -1.0 : 1.0, 1e-9);
    EXPECT_TRUE(options.reflection || !why.motion.reflected);
    EXPECT_NEAR(why.motion.scale / (options.keepScale ? 1.0 : a.scale / b.scale), 1.0, 1e-12);
    EXPECT_NEAR(why.similarity + why.dissimilarity, 1.0, 16.0 / 65535.0) << "shares in steps";
    double shares = 0.0;
    double before = 1.0;
    std::vector<bool> metA(a.points.size(), false), metB(b.points.size(), false);
    for (const PointMatch& match : why.matches) {
        EXPECT_GT(match.share, 0.0);
        EXPECT_LE(match.share, before);
        before = match.share;
        shares += match.share;
        metA[match.a] = true;
        metB[match.b] = true;
        if (options.keepScale && a.scale != b.scale) continue;
        const Point3 moved = apply(why.motion, pointPosition(b, match.b));
        const double size = a.scale + length(a.origin) + why.motion.scale * length(b.origin);
        EXPECT_NEAR(distance(pointPosition(a, match.a), moved), match.distance * a.scale,
                    1e-5 * size + 1.3e-4 * (a.scale + why.motion.scale * b.scale))
            << "parts are kept in steps";
    }
    if (!why.matches.empty()) {
        EXPECT_NEAR(shares, 1.0, 1e-9);
    }
    for (const std::uint32_t i : why.unmatchedA) EXPECT_FALSE(metA[i]);
    for (const std::uint32_t i : why.unmatchedB) EXPECT_FALSE(metB[i]);
    const auto met = [](const std::vector<bool>& all) {
        return static_cast<std::size_t>(std::count(all.begin(), all.end(), true));
    };
    EXPECT_EQ(met(metA) + why.unmatchedA.size(), a.points.size());
    EXPECT_EQ(met(metB) + why.unmatchedB.size(), b.points.size());
}

TEST(ExplainAttributed, AgreesWithTheScore) {
    Random random(9);
    for (int round = 0; round < 1000; ++round) {
        Pair pair = randomPair(random);
        pair.b.scale = pair.a.scale * std::exp(random.uniform(-0.5, 0.5));
        for (const ScoreOptions& options : everyOption()) expectConsistent(pair.a, pair.b, options);
        if (HasFailure()) FAIL() << describeSignature(pair.a) << "\n" << describeSignature(pair.b);
    }
}

TEST(ExplainAttributed, OfTheReversePairIsTheInverse) {
    Random random(10);
    for (int round = 0; round < 500; ++round) {
        const Pair pair = randomPair(random);
        if (sameShape(pair.a, pair.b)) continue;
        const Explanation forth = explain(pair.a, pair.b, {});
        const Explanation back = explain(pair.b, pair.a, {});
        EXPECT_TRUE(sameBits(forth.score, back.score));
        EXPECT_TRUE(sameBits(forth.similarity, back.similarity));
        EXPECT_EQ(forth.unmatchedA, back.unmatchedB);
        EXPECT_EQ(forth.unmatchedB, back.unmatchedA);
        ASSERT_EQ(forth.matches.size(), back.matches.size());
        ASSERT_EQ(forth.terms.size(), back.terms.size());
        for (std::size_t i = 0; i < forth.terms.size(); ++i) {
            EXPECT_TRUE(sameBits(forth.terms[i].distance, back.terms[i].distance));
        }
        const Motion round0 = compose(back.motion, forth.motion);
        EXPECT_NEAR(round0.scale, 1.0, 1e-12);
        EXPECT_FALSE(round0.reflected);
        EXPECT_NEAR(round0.rotation[0][0] + round0.rotation[1][1] + round0.rotation[2][2], 3.0, 1e-9);
    }
}

// A scan turned, mirrored, scaled and moved by a known motion: explain finds it again.
TEST(ExplainAttributed, FindsTheMotionBetweenTwoScans) {
    Random random(11);
    for (const char* family : {"animal", "airplane", "hammer"}) {
        ScanOptions options;
        options.count = 4000;
        options.randomPose = false;
        const PointCloud points = scanOf(makeMember(family, 0, 1).value(), options).value();
        const Signature a = describe(points, parametersOf(Profile::kDefault)).value().signature;
        for (const bool mirrored : {false, true}) {
            Motion motion;
            motion.rotation = mirrored ? randomReflection(random) : randomRotation(random);
            motion.reflected = mirrored;
            motion.scale = 3.5;
            motion.translation = {10, -20, 5};
            const PointCloud other = applyToCloud(motion, points);
            const Signature b = describe(other, parametersOf(Profile::kDefault)).value().signature;
            const Explanation why = explain(a, b, {});
            EXPECT_GT(why.score, 0.95) << family;
            EXPECT_NEAR(why.motion.scale * motion.scale, 1.0, 0.02) << family;
            EXPECT_FALSE(why.degenerate);
            // Shapes with a plane of symmetry may come back mirrored: what counts is where the
            // segments land.
            double sum = 0.0;
            double total = 0.0;
            for (std::size_t i = 0; i < std::min(a.points.size(), b.points.size()); ++i) {
                const Point3 there = apply(why.motion, apply(motion, pointPosition(a, i)));
                double nearest = 1e9;
                for (std::size_t j = 0; j < a.points.size(); ++j) {
                    nearest = std::min(nearest, distance(there, pointPosition(a, j)));
                }
                sum += a.points[i].weight * nearest / a.scale;
                total += a.points[i].weight;
            }
            EXPECT_LT(sum / total, 0.03) << family << " mirrored " << mirrored;
        }
    }
}

TEST(AttributeScore, WithoutAttributesOnOneSideComparesPointsAndWeights) {
    Random random(12);
    for (int round = 0; round < 500; ++round) {
        const Pair pair = randomPair(random);
        Signature plainA = pair.a;
        Signature plainB = pair.b;
        plainA.attributes.reset();
        plainB.attributes.reset();
        for (const ScoreOptions& options : everyOption()) {
            // But for being the same shape, which those of different kinds never are.
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

TEST(AttributeScore, OfSinglePointsIsSound) {
    Random random(13);
    for (int round = 0; round < 200; ++round) {
        const Signature a = randomAttributed(random, 1);
        const Signature b = randomAttributed(random, 1);
        const Signature c = randomAttributed(random, 5);
        for (const ScoreOptions& options : everyOption()) {
            expectSound(a, b, options);
            expectSound(a, c, options);
            expectConsistent(a, b, options);
            expectConsistent(a, c, options);
        }
        EXPECT_TRUE(explain(a, c, {}).degenerate);
    }
}

TEST(AttributeScore, StaysANumberForExtremeNumbers) {
    Random random(14);
    const std::array<double, 5> lengths = {1e-30, 1e-7, 1.0, 1e3, 1e18};
    for (int round = 0; round < 1000; ++round) {
        const auto extreme = [&] {
            Signature s = randomAttributed(random, 5);
            const float length = static_cast<float>(lengths[random.below(lengths.size())]);
            const float weight = static_cast<float>(std::pow(10.0, random.uniform(-30, 30)));
            for (WeightedPoint& p : s.points) {
                for (float& x : p.position) x *= length;
                for (float& x : p.covariance) x *= length * length;
                p.weight *= weight;
            }
            while (!s.points.empty() && !(s.points.back().weight > 0.0f)) s.points.pop_back();
            s.scale = std::pow(10.0, random.uniform(-40, 40));
            if (!s.points.empty()) testing_support::updateBody(s);
            return s;
        };
        const Signature a = extreme();
        const Signature b = extreme();
        if (a.points.empty() || b.points.empty()) continue;
        for (const double width : {kMinKernelWidth, 0.1, kMaxKernelWidth}) {
            for (const ScoreOptions& options : everyOption(width)) {
                const double value = score(a, b, options);
                EXPECT_GT(value, 0.0);
                EXPECT_LE(value, 1.0);
                EXPECT_GE(scoreUpperBound(a, b, options), value);
                const Explanation why = explain(a, b, options);
                EXPECT_TRUE(sameBits(why.score, value));
                for (const PointMatch& match : why.matches) {
                    EXPECT_TRUE(std::isfinite(match.share) && std::isfinite(match.distance));
                }
            }
        }
    }
}

// What it is all for: a second, noisy scan is nearest to its own family.
TEST(AttributeScore, NearestScanIsOfTheSameFamily) {
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
