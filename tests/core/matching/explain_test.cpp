// SPDX-License-Identifier: GPL-3.0-or-later
#include <algorithm>
#include <cmath>
#include <iostream>
#include <set>

#include <gtest/gtest.h>

#include "core/matching/published/published_scorer.h"
#include "core/matching/score.h"
#include "core/pipeline.h"
#include "core/synthetic/families.h"
#include "core/synthetic/named_shapes.h"
#include "tests/core/matching/random_signatures.h"

namespace shapedb {
namespace {

using testing_support::describeSignature;
using testing_support::disturbed;
using testing_support::randomReflection;
using testing_support::randomSignature;
using testing_support::sameBits;
using testing_support::scoreOptions;
using testing_support::signatureOf;
using testing_support::turned;

void expectOrthonormal(const Matrix3& r, bool reflected) {
    for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t j = 0; j < 3; ++j) {
            const double product = r[i][0] * r[j][0] + r[i][1] * r[j][1] + r[i][2] * r[j][2];
            EXPECT_NEAR(product, i == j ? 1.0 : 0.0, 1e-12);
        }
    }
    EXPECT_NEAR(determinant(r), reflected ? -1.0 : 1.0, 1e-12);
}

// Indices 0 to count - 1, each once: matched or unmatched.
void expectPartition(std::size_t count, const std::vector<PointMatch>& matches,
                     std::uint32_t PointMatch::*side, const std::vector<std::uint32_t>& unmatched) {
    std::multiset<std::uint32_t> all(unmatched.begin(), unmatched.end());
    for (const PointMatch& match : matches) all.insert(match.*side);
    std::multiset<std::uint32_t> expected;
    for (std::uint32_t i = 0; i < count; ++i) expected.insert(i);
    EXPECT_EQ(all, expected);
    EXPECT_TRUE(std::is_sorted(unmatched.begin(), unmatched.end()));
}

void expectConsistent(const Signature& a, const Signature& b, const ScoreOptions& options,
                      const Explanation& why) {
    EXPECT_TRUE(sameBits(why.score, score(a, b, options)));
    expectOrthonormal(why.motion.rotation, why.motion.reflected);
    EXPECT_TRUE(options.reflection || !why.motion.reflected);
    EXPECT_NEAR(why.motion.scale / (options.keepScale ? 1.0 : a.scale / b.scale), 1.0, 1e-12);
    EXPECT_EQ(why.degenerate, a.points.size() == 1 || b.points.size() == 1);

    double shares = 0.0;
    double before = 1.0;
    for (const PointMatch& match : why.matches) {
        EXPECT_GT(match.share, 0.0);
        EXPECT_LE(match.share, before + 1e-15);
        before = match.share;
        shares += match.share;
        // The motion takes b's scan to a's: the distance is what is left between the two there.
        const Point3 moved = apply(why.motion, pointPosition(b, match.b));
        const double size = std::max({1.0, length(a.origin), why.motion.scale * length(b.origin)});
        EXPECT_NEAR(distance(pointPosition(a, match.a), moved), match.distance * a.scale, 1e-11 * size);
    }
    EXPECT_NEAR(shares, 1.0, 1e-12);
    expectPartition(a.points.size(), why.matches, &PointMatch::a, why.unmatchedA);
    expectPartition(b.points.size(), why.matches, &PointMatch::b, why.unmatchedB);

    EXPECT_GE(why.similarity, 0.0);
    EXPECT_GE(why.dissimilarity, 0.0);
    const double ratio = why.similarity / (why.similarity + why.dissimilarity);
    if (why.degenerate && why.score < 1.0) {
        EXPECT_NEAR(why.score, std::min(ratio, kDegenerateCeiling), 1e-12);
    } else {
        EXPECT_NEAR(why.score, ratio, 1e-12);
    }
}

void expectInverse(const Explanation& forth, const Explanation& back) {
    EXPECT_TRUE(sameBits(forth.score, back.score));
    EXPECT_TRUE(sameBits(forth.similarity, back.similarity));
    EXPECT_TRUE(sameBits(forth.dissimilarity, back.dissimilarity));
    EXPECT_EQ(forth.unmatchedA, back.unmatchedB);
    EXPECT_EQ(forth.unmatchedB, back.unmatchedA);
    EXPECT_EQ(forth.degenerate, back.degenerate);
    ASSERT_EQ(forth.matches.size(), back.matches.size());
    for (std::size_t i = 0; i < forth.matches.size(); ++i) {
        EXPECT_EQ(forth.matches[i].a, back.matches[i].b);
        EXPECT_EQ(forth.matches[i].b, back.matches[i].a);
        EXPECT_EQ(forth.matches[i].share, back.matches[i].share);
    }
    const Motion round = compose(back.motion, forth.motion);
    EXPECT_NEAR(round.scale, 1.0, 1e-12);
    EXPECT_FALSE(round.reflected);
    const double size = 1.0 + length(forth.motion.translation) * back.motion.scale;
    EXPECT_LT(length(round.translation), 1e-11 * size);
    expectOrthonormal(round.rotation, false);
    EXPECT_NEAR(round.rotation[0][0] + round.rotation[1][1] + round.rotation[2][2], 3.0, 1e-12);
}

TEST(Explain, AgreesWithTheScoreAndWithItself) {
    Random random(1);
    int reflected = 0;
    for (int round = 0; round < 3000; ++round) {
        const Signature a = randomSignature(random);
        Signature b = randomSignature(random);
        if (round % 3 == 0) b = turned(disturbed(a, random, 0.03), randomRotation(random));
        if (round % 3 == 1) b = turned(disturbed(a, random, 0.03), randomReflection(random));
        b.scale = a.scale * std::exp(random.uniform(-0.5, 0.5));
        b.origin = {random.uniform(-5, 5), random.uniform(-5, 5), random.uniform(-5, 5)};
        ScoreOptions options;
        options.reflection = random.below(2) == 1;
        options.keepScale = random.below(2) == 1;
        const Explanation why = explain(a, b, options);
        expectConsistent(a, b, options, why);
        expectInverse(why, explain(b, a, options));
        reflected += why.motion.reflected ? 1 : 0;
        if (HasFailure()) FAIL() << describeSignature(a) << "\n" << describeSignature(b);
    }
    EXPECT_GT(reflected, 300);
}

TEST(Explain, OfTheSameSignatureIsTheIdentity) {
    Random random(2);
    for (int round = 0; round < 200; ++round) {
        const Signature a = randomSignature(random, testing_support::Kind::kPlain, 7);
        const Explanation why = explain(a, a, {});
        EXPECT_EQ(why.score, 1.0);
        EXPECT_EQ(why.matches.size(), a.points.size());
        EXPECT_TRUE(why.unmatchedA.empty() && why.unmatchedB.empty());
        for (const PointMatch& match : why.matches) {
            EXPECT_EQ(match.a, match.b);
            EXPECT_NEAR(match.distance, 0.0, 1e-6);
            const Point3 p = pointPosition(a, match.a);
            EXPECT_LT(distance(apply(why.motion, p), p), 1e-6 * a.scale);
        }
    }
}

TEST(Explain, KeepsSizesWhenAskedTo) {
    // The same shape twice as large: with its size kept, the arm of b ends half way along a's.
    Signature a = signatureOf({{0, 0, 0, 0.5}, {0.1, 0, 0, 0.25}});
    Signature b = a;
    a.scale = 2.0;
    const Explanation free = explain(a, b, scoreOptions(true, false, 0.1));
    EXPECT_EQ(free.score, 1.0);
    EXPECT_EQ(free.motion.scale, 2.0);
    const Explanation kept = explain(a, b, scoreOptions(true, true, 0.1));
    EXPECT_EQ(kept.motion.scale, 1.0);
    ASSERT_EQ(kept.matches.size(), 2u);
    EXPECT_NEAR(kept.matches[1].distance, 0.05, 1e-6);  // of a's scale: 0.1 in the scan
    const Explanation back = explain(b, a, scoreOptions(true, true, 0.1));
    EXPECT_NEAR(back.matches[1].distance, 0.1, 1e-6);  // of the smaller b's: again 0.1
}

TEST(Explain, SaysThatASinglePointLeavesTheRotationOpen) {
    const Signature ball = signatureOf({{0, 0, 0, 0.1}});
    const Signature other = signatureOf({{0, 0, 0, 0.08}, {0.3, 0, 0, 0.02}});
    const Explanation why = explain(ball, other, {});
    EXPECT_TRUE(why.degenerate);
    ASSERT_EQ(why.matches.size(), 1u);
    EXPECT_EQ(why.unmatchedB, std::vector<std::uint32_t>{1});
    expectConsistent(ball, other, {}, why);
    EXPECT_FALSE(explain(other, other, {}).degenerate);
}

// Two independent noisy scans of one solid.
struct Scanned {
    Signature a, b;
    PointCloud pointsA, pointsB;
    double diagonal = 0.0;
};

Scanned scanTwice(const Solid& solid, const Motion& motion, std::uint64_t seed) {
    ScanOptions options;
    options.count = 6000;
    options.noise = 0.001;
    options.randomPose = false;
    options.seed = seed;
    Scanned scanned;
    scanned.pointsA = scanOf(solid, options).value();
    options.seed = seed + 1000;
    scanned.pointsB = applyToCloud(motion, scanOf(solid, options).value());
    const ShapeParameters parameters = parametersOf(Profile::kPaper);
    scanned.a = describe(scanned.pointsA, parameters).value().signature;
    scanned.b = describe(scanned.pointsB, parameters).value().signature;
    scanned.diagonal = boundsOf(solid).diagonal();
    return scanned;
}

// Mean distance from the moved points of b (every 20th) to the nearest of a, as a share of the box.
double misfit(const Scanned& scanned, const Motion& motion) {
    double sum = 0.0;
    std::size_t count = 0;
    for (std::size_t q = 0; q < scanned.pointsB.size(); q += 20) {
        const Point3 moved = apply(motion, scanned.pointsB[q]);
        double nearest = 1e300;
        for (const Point3& p : scanned.pointsA) nearest = std::min(nearest, squaredDistance(p, moved));
        sum += std::sqrt(nearest);
        ++count;
    }
    return sum / static_cast<double>(count) / scanned.diagonal;
}

// Of solids whose heavy parts span space: those of a hammer lie on a line, a table's top outweighs
// its legs, and seven weighted points then leave the roll to chance.
TEST(Explain, MotionCarriesOneScanOntoTheOther) {
    Random random(3);
    struct Case {
        std::string name;
        Solid solid;
    };
    std::vector<Case> cases = {{"dumbbell", makeDumbbell().solid}, {"jack", makeJack().solid}};
    for (const char* family : {"airplane", "animal", "bird", "human"}) {
        cases.push_back({family, makeMember(family, 1, 1).value()});
    }
    for (const Case& c : cases) {
        for (const bool reflected : {false, true}) {
            Motion motion;
            motion.scale = std::exp(random.uniform(-2, 2));
            motion.rotation = reflected ? randomReflection(random) : randomRotation(random);
            motion.reflected = reflected;
            motion.translation = {random.uniform(-20, 20), random.uniform(-20, 20), random.uniform(-20, 20)};
            const Scanned scanned = scanTwice(c.solid, motion, 7);
            const Explanation why = explain(scanned.a, scanned.b, {});
            const double error = misfit(scanned, why.motion);
            const double ideal = misfit(scanned, inverse(motion));
            std::cout << c.name << (reflected ? " mirrored" : "") << ": score " << why.score << ", misfit "
                      << error << " of the box (ideal " << ideal << ")\n";
            EXPECT_GT(why.score, 0.85) << c.name;
            EXPECT_LT(error, ideal + 0.01) << c.name;
            EXPECT_NEAR(why.motion.scale * motion.scale, 1.0, 0.02) << c.name;
        }
    }
}

}  // namespace
}  // namespace shapedb
