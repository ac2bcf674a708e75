// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/matching/published/alignment.h"

#include <cmath>

#include <gtest/gtest.h>

#include "core/matching/kernel.h"
#include "tests/core/matching/random_signatures.h"

namespace shapedb {
namespace {

using testing_support::describeSignature;
using testing_support::disturbed;
using testing_support::randomSignature;
using testing_support::sameBits;
using testing_support::signatureOf;

AnchoredPoints pointsOf(const Signature& signature, double factor) {
    return anchoredPoints(PackedShape(signature).row(), factor);
}

void expectSame(const BestAlignment& x, const BestAlignment& y) {
    EXPECT_EQ(x.alignment.i, y.alignment.i);
    EXPECT_EQ(x.alignment.j, y.alignment.j);
    EXPECT_EQ(x.alignment.k, y.alignment.k);
    EXPECT_EQ(x.alignment.l, y.alignment.l);
    EXPECT_EQ(x.alignment.reflected, y.alignment.reflected);
    EXPECT_TRUE(sameBits(x.matches.similarity, y.matches.similarity))
        << x.matches.similarity << " and " << y.matches.similarity;
    ASSERT_EQ(x.matches.count, y.matches.count);
    for (std::size_t i = 0; i < x.matches.count; ++i) {
        EXPECT_EQ(x.matches.pairs[i].a, y.matches.pairs[i].a);
        EXPECT_EQ(x.matches.pairs[i].b, y.matches.pairs[i].b);
        EXPECT_TRUE(sameBits(x.matches.pairs[i].gain, y.matches.pairs[i].gain));
        EXPECT_TRUE(sameBits(x.matches.pairs[i].squaredDistance, y.matches.pairs[i].squaredDistance));
    }
}

TEST(Alignment, PruningDoesNotChangeTheResult) {
    Random random(1);
    for (int round = 0; round < 4000; ++round) {
        const Signature a = randomSignature(random, round % 100 == 0 ? 16 : 7);
        const Signature b = round % 3 == 0 ? disturbed(a, random, 0.02) : randomSignature(random, 7);
        ScoreOptions options;
        options.reflection = round % 2 == 0;
        // Down to widths at which only exact coincidence counts, and bounds are nothing but rounding.
        options.kernelWidth = std::pow(10.0, random.uniform(-6, 1));
        const AnchoredPoints left = pointsOf(a, 1.0);
        const AnchoredPoints right = pointsOf(b, random.uniform(0.2, 1.0));
        expectSame(bestAlignment(left, right, options, true), bestAlignment(left, right, options, false));
        if (HasFailure()) {
            FAIL() << "width " << options.kernelWidth << "\n"
                   << describeSignature(a) << "\n"
                   << describeSignature(b);
        }
    }
}

TEST(Alignment, ScalesLengthsAndWeightsByTheCube) {
    const Signature signature = signatureOf({{0, 0, 0, 0.5}, {0.5, -0.25, 0.125, 0.25}});
    const AnchoredPoints points = pointsOf(signature, 0.5);
    ASSERT_EQ(points.count, 2u);
    EXPECT_EQ(points.position[1], (Point3{0.25, -0.125, 0.0625}));
    EXPECT_EQ(points.weight[0], 0.0625);
    EXPECT_EQ(points.weight[1], 0.03125);
    EXPECT_EQ(points.totalWeight, 0.09375);
}

TEST(Alignment, RotationReproducesTheDistancesOfTheMatches) {
    Random random(2);
    int reflected = 0;
    for (int round = 0; round < 2000; ++round) {
        const Signature a = randomSignature(random);
        const Signature b = round % 2 == 0 ? disturbed(a, random, 0.05) : randomSignature(random);
        const AnchoredPoints left = pointsOf(a, 1.0);
        const AnchoredPoints right = pointsOf(b, 1.0);
        const BestAlignment best = bestAlignment(left, right, {});
        const Matrix3 rotation = alignmentRotation(left, right, best.alignment);
        EXPECT_NEAR(determinant(rotation), best.alignment.reflected ? -1.0 : 1.0, 1e-12);
        reflected += best.alignment.reflected ? 1 : 0;
        double sum = 0.0;
        for (std::size_t m = 0; m < best.matches.count; ++m) {
            const PairList::Pair& pair = best.matches.pairs[m];
            const double d = distance(left.position[pair.a], rotate(rotation, right.position[pair.b]));
            EXPECT_NEAR(d, std::sqrt(pair.squaredDistance), 1e-12);
            EXPECT_EQ(pair.gain, std::min(left.weight[pair.a], right.weight[pair.b]) *
                                     kernel(pair.squaredDistance, 0.1));
            sum += pair.gain;
        }
        EXPECT_DOUBLE_EQ(sum, best.matches.similarity);
    }
    EXPECT_GT(reflected, 100);
}

}  // namespace
}  // namespace shapedb
