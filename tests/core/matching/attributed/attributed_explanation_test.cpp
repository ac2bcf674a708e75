// SPDX-License-Identifier: GPL-3.0-or-later
// The explanations of signatures with attributes.
#include <algorithm>
#include <cmath>
#include <set>
#include <string>

#include <gtest/gtest.h>

#include "core/matching/attributed/attribute_distance.h"
#include "core/matching/score.h"
#include "core/pipeline.h"
#include "core/synthetic/families.h"
#include "tests/core/matching/attributed_signatures.h"
#include "tests/core/matching/random_signatures.h"

namespace shapedb {
namespace {

using testing_support::AttributedPair;
using testing_support::describeSignature;
using testing_support::everyOption;
using testing_support::randomAttributed;
using testing_support::randomReflection;
using testing_support::randomSizedPair;
using testing_support::sameBits;

void expectTermsMakeTheScore(const Signature& a, const Signature& b, const ScoreOptions& options,
                             const Explanation& why) {
    ASSERT_EQ(why.terms.size(), kStatisticKinds + 1);
    double weight = 0.0;
    double mean = 0.0;
    std::set<std::string> names;
    const bool paths = !a.attributes->earlier && !b.attributes->earlier;
    for (std::size_t i = 0; i < why.terms.size(); ++i) {
        const ScoreTerm& term = why.terms[i];
        EXPECT_GE(term.distance, 0.0);
        const bool leftOut = i < kStatisticKinds && kStatistics[i].ofPaths && !paths;
        EXPECT_EQ(term.weight > 0.0, !leftOut) << term.name;
        weight += term.weight;
        mean += term.weight * term.distance;
        names.insert(term.name);
    }
    EXPECT_EQ(names.size(), why.terms.size());
    EXPECT_EQ(names.count("parts"), 1U);
    EXPECT_NEAR(weight, 1.0, 1e-12);
    const double octaves = options.keepScale ? std::abs(std::log2(a.scale / b.scale)) : 0.0;
    AttributeDistance asOne;  // the same mean without parts
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
    EXPECT_NEAR(why.similarity + why.dissimilarity, 1.0, 16.0 / 65535.0) << "shares are rounded";
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
            << "positions are rounded to steps";
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

TEST(AttributedExplanation, AgreesWithTheScore) {
    Random random(9);
    for (int round = 0; round < 1000; ++round) {
        AttributedPair pair = randomSizedPair(random);
        pair.b.scale = pair.a.scale * std::exp(random.uniform(-0.5, 0.5));
        for (const ScoreOptions& options : everyOption()) expectConsistent(pair.a, pair.b, options);
        if (HasFailure()) FAIL() << describeSignature(pair.a) << "\n" << describeSignature(pair.b);
    }
}

TEST(AttributedExplanation, AgreesWithTheScoreOfSinglePointShapes) {
    testing_support::forSinglePointPairs(
        [](const Signature& a, const Signature& b, const ScoreOptions& options) {
            expectConsistent(a, b, options);
            EXPECT_TRUE(explain(a, b, options).degenerate);
        });
}

TEST(AttributedExplanation, ReversePairHasTheInverseMotion) {
    Random random(10);
    for (int round = 0; round < 500; ++round) {
        const AttributedPair pair = randomSizedPair(random);
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

// A scan and its copy under a known motion.
TEST(AttributedExplanation, FindsTheMotionBetweenTwoScans) {
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
            // Shapes with a plane of symmetry may come back mirrored; what counts is where the segments
            // land.
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

}  // namespace
}  // namespace shapedb
