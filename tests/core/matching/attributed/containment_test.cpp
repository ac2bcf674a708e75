// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/matching/attributed/containment.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <string>

#include <gtest/gtest.h>

#include "core/matching/score.h"
#include "tests/core/matching/attributed_signatures.h"
#include "tests/core/matching/random_signatures.h"

namespace shapedb {
namespace {

using testing_support::describeSignature;
using testing_support::disturbedAttributed;
using testing_support::randomAttributed;
using testing_support::randomReflection;
using testing_support::sameBits;
using testing_support::scannedFamilies;
using testing_support::scoreOptions;
using testing_support::turnedAttributed;

const Body& bodyOf(const Signature& signature) { return signature.attributes->body; }

ScoreOptions partialOptions(bool reflection, bool keepScale, double width = 0.1) {
    ScoreOptions options = scoreOptions(reflection, keepScale, width);
    options.partial = true;
    return options;
}

// The points of `whole` that `keep` names, as a scan of just these would give them: anchored at its own
// heaviest, in units of a scale `size` times that of the whole.
Signature pieceOf(const Signature& whole, const std::vector<std::size_t>& keep, double size) {
    Signature piece = whole;
    piece.points.clear();
    piece.scale = whole.scale * size;
    piece.origin = pointPosition(whole, keep.front());
    float share = 0.0f;
    for (const std::size_t i : keep) share += whole.points[i].volumeShare;
    const float s = static_cast<float>(size);
    for (const std::size_t i : keep) {
        WeightedPoint p = whole.points[i];
        for (std::size_t k = 0; k < 3; ++k) {
            p.position[k] = (p.position[k] - whole.points[keep.front()].position[k]) / s;
        }
        p.weight /= s * s * s;
        p.volumeShare /= share;
        p.maximumRadius /= s;
        for (float& c : p.covariance) c /= s * s;
        piece.points.push_back(p);
    }
    testing_support::updateBody(piece);
    return piece;
}

// A body and limbs, each of its own size.
Signature creature() {
    Signature s = testing_support::signatureOf({{0, 0, 0, 0.05},
                                                {0.45, 0, 0.05, 0.02},
                                                {0.1, 0.3, 0, 0.015},
                                                {-0.1, -0.25, 0.1, 0.012},
                                                {-0.4, 0.05, 0.2, 0.01},
                                                {0.1, 0.1, -0.35, 0.008}});
    for (std::size_t i = 0; i < s.points.size(); ++i) {
        const float x = 0.12f - 0.012f * static_cast<float>(i);
        const float y = i % 2 == 0 ? 0.5f * x : x;
        s.points[i].covariance = {x * x, 0, 0, y * y, 0, 0.3f * x * x};
        s.points[i].maximumRadius = 0.7f * x;
    }
    s.attributes.emplace();
    testing_support::updateBody(s);
    return s;
}

TEST(Containment, FindsAPieceInItsWholeInAnyPose) {
    const Signature whole = creature();
    Random random(1);
    for (int round = 0; round < 60; ++round) {
        const bool mirrored = round % 2 == 1;
        const double size = random.uniform(0.4, 1.2);
        const Signature cut = pieceOf(whole, {0, 1, 2, 4}, size);
        const Signature piece =
            turnedAttributed(cut, mirrored ? randomReflection(random) : randomRotation(random));
        const double known = round % 3 == 0 ? size : 0.0;
        const Containment found = containment(bodyOf(piece), bodyOf(whole), known, {});
        EXPECT_GT(found.share, 0.99);
        EXPECT_NEAR(found.scale, size, 0.01);
        EXPECT_EQ(found.reflected, mirrored);
        EXPECT_NEAR(determinant(found.rotation), mirrored ? -1.0 : 1.0, 1e-9);
        const SegmentPairs pairs = containedPairs(bodyOf(piece), bodyOf(whole), found, {});
        ASSERT_EQ(pairs.count, 4U);
        const std::array<std::uint8_t, 4> expected{0, 1, 2, 4};
        for (std::size_t i = 0; i < 4; ++i) {
            EXPECT_EQ(pairs.pairs[i].a, i);
            EXPECT_EQ(pairs.pairs[i].b, expected[i]);
            EXPECT_LT(pairs.pairs[i].distance, 0.01);
            // As the header writes the motion.
            const auto& x = bodyOf(whole).segments[expected[i]].position;
            const auto& y = bodyOf(piece).segments[i].position;
            const Point3 moved =
                (1.0 / found.scale) * rotate(found.rotation, Point3{x[0], x[1], x[2]} - found.from) +
                found.to;
            EXPECT_LT(distance(moved, {y[0], y[1], y[2]}), 0.01);
        }
    }
}

TEST(Containment, WholeIsNotContainedInItsPiece) {
    const Signature whole = creature();
    const Signature piece = pieceOf(whole, {0, 2, 3}, 0.8);
    const double contained = containment(bodyOf(piece), bodyOf(whole), 0.0, {}).share;
    const double containing = containment(bodyOf(whole), bodyOf(piece), 0.0, {}).share;
    EXPECT_GT(contained, 0.99);
    EXPECT_LT(containing, 0.85);
    EXPECT_GT(score(piece, whole, partialOptions(true, false)),
              score(whole, piece, partialOptions(true, false)));
    EXPECT_GT(score(piece, whole, partialOptions(true, false)), score(piece, whole, {}));
}

TEST(Containment, MirroredPieceNeedsReflection) {
    const Signature whole = creature();
    Random random(2);
    const Signature piece = turnedAttributed(pieceOf(whole, {0, 1, 2, 3, 4}, 0.9), randomReflection(random));
    EXPECT_GT(containment(bodyOf(piece), bodyOf(whole), 0.0, scoreOptions(true, false, 0.05)).share, 0.99);
    const Containment without =
        containment(bodyOf(piece), bodyOf(whole), 0.0, scoreOptions(false, false, 0.05));
    EXPECT_LT(without.share, 0.95);
    EXPECT_FALSE(without.reflected);
}

TEST(Containment, BoundHoldsAndGainsSumToTheShare) {
    Random random(3);
    for (int round = 0; round < 1500; ++round) {
        const Signature a = randomAttributed(random);
        const Signature b =
            round % 2 == 0 ? randomAttributed(random)
                           : turnedAttributed(disturbedAttributed(a, random, 0.02), randomRotation(random));
        const double known = round % 3 == 0 ? std::exp(random.uniform(-1, 1)) : 0.0;
        const ScoreOptions options =
            scoreOptions(round % 5 != 0, false, std::pow(10.0, random.uniform(-2, 0.5)));
        const Containment found = containment(bodyOf(a), bodyOf(b), known, options);
        ASSERT_GE(found.share, 0.0);
        ASSERT_LE(found.share, 1.0);
        ASSERT_GE(containmentBound(bodyOf(a), bodyOf(b), known), found.share);
        ASSERT_LE(containmentBound(bodyOf(a), bodyOf(b), known), 1.0);
        const SegmentPairs pairs = containedPairs(bodyOf(a), bodyOf(b), found, options);
        double sum = 0.0;
        for (std::size_t i = 0; i < pairs.count; ++i) sum += pairs.pairs[i].gain;
        EXPECT_NEAR(sum, found.share, 1e-9) << describeSignature(a);
    }
}

void expectSound(const Signature& a, const Signature& b, const ScoreOptions& options) {
    const double value = score(a, b, options);
    ASSERT_GE(value, 0.0);
    ASSERT_LE(value, 1.0);
    ASSERT_GE(scoreUpperBound(a, b, options), value);
    ASSERT_LE(scoreUpperBound(a, b, options), 1.0);
    const bool same = sameShape(a, b) && (!options.keepScale || a.scale == b.scale);
    ASSERT_EQ(value == 1.0, same);
    const Explanation why = explain(a, b, options);
    ASSERT_TRUE(sameBits(why.score, value));
    EXPECT_NEAR(determinant(why.motion.rotation), why.motion.reflected ? -1.0 : 1.0, 1e-9);
    if (!a.attributes || !b.attributes) return;
    double weight = 0.0;
    std::set<std::string> names;
    for (const ScoreTerm& term : why.terms) {
        EXPECT_GE(term.distance, 0.0);
        weight += term.weight;
        names.insert(term.name);
    }
    EXPECT_NEAR(weight, 1.0, 1e-12);
    EXPECT_EQ(names.size(), why.terms.size());
    double shares = 0.0;
    for (const PointMatch& match : why.matches) {
        ASSERT_LT(match.a, a.points.size());
        ASSERT_LT(match.b, b.points.size());
        shares += match.share;
        const Point3 moved = apply(why.motion, pointPosition(b, match.b));
        const double size = a.scale + length(a.origin) + why.motion.scale * (b.scale + length(b.origin));
        EXPECT_NEAR(distance(pointPosition(a, match.a), moved), match.distance * a.scale,
                    1e-5 * size + 1.3e-4 * (a.scale + why.motion.scale * b.scale))
            << "positions are rounded to steps";
    }
    if (!why.matches.empty()) {
        EXPECT_NEAR(shares, 1.0, 1e-9);
    }
}

TEST(PartialScore, IsBoundedAndExplainedOnRandomPairs) {
    Random random(4);
    for (int round = 0; round < 600; ++round) {
        Signature a = randomAttributed(random);
        Signature b = round % 2 == 0
                          ? randomAttributed(random)
                          : turnedAttributed(disturbedAttributed(a, random, 0.02), randomRotation(random));
        b.scale = a.scale * std::exp(random.uniform(-0.5, 0.5));
        if (round % 10 == 0) b = a;
        for (const bool keepScale : {false, true}) {
            expectSound(a, b, partialOptions(round % 3 != 0, keepScale));
            expectSound(a, b, partialOptions(true, keepScale, std::pow(10.0, random.uniform(-6, 6))));
        }
        a.attributes.reset();
        expectSound(a, b, partialOptions(true, false));
        b.attributes.reset();
        expectSound(a, b, partialOptions(true, true));
        if (HasFailure()) FAIL() << describeSignature(a) << "\n" << describeSignature(b);
    }
}

TEST(PartialScore, IsBoundedAndExplainedOnScans) {
    const auto& scans = scannedFamilies(1, 1);
    for (const auto& x : scans) {
        for (const auto& y : scans) expectSound(x.signature, y.signature, partialOptions(true, false));
    }
}

TEST(PartialScore, StaysFiniteForExtremeSizes) {
    Random random(5);
    for (int round = 0; round < 300; ++round) {
        Signature a = randomAttributed(random, 5);
        Signature b = randomAttributed(random, 5);
        a.scale = std::pow(10.0, random.uniform(-40, 40));
        b.scale = std::pow(10.0, random.uniform(-40, 40));
        for (const bool keepScale : {false, true}) {
            const ScoreOptions options = partialOptions(true, keepScale);
            const double value = score(a, b, options);
            EXPECT_GT(value, 0.0);
            EXPECT_LT(value, 1.0);
            EXPECT_GE(scoreUpperBound(a, b, options), value);
            EXPECT_TRUE(sameBits(explain(a, b, options).score, value));
        }
    }
}

}  // namespace
}  // namespace shapedb
