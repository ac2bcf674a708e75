// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/matching/attributed/attribute_distance.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <gtest/gtest.h>

#include "core/matching/attributed/attributed_query.h"
#include "core/matching/score.h"
#include "tests/core/matching/attributed_signatures.h"
#include "tests/core/matching/random_signatures.h"

namespace shapedb {
namespace {

using testing_support::AttributedPair;
using testing_support::everyOption;
using testing_support::expectSoundScore;
using testing_support::randomAttributed;
using testing_support::randomAttributedPair;
using testing_support::sameBits;

LevelSums sumsOf(const Signature& a, const Signature& b) {
    return AttributedQuery(a).levelSums(PackedShape(b).row());
}

std::vector<ScoreTerm> termsOf(const Signature& a, const Signature& b, double agreement) {
    return scoreTerms(sumsOf(a, b), a.attributes->quality, b.attributes->quality, agreement);
}

double containedWeightOf(const Signature& a, const Signature& b) {
    return partialTerms(sumsOf(a, b), a.attributes->quality, b.attributes->quality, 0.5, 0.5).back().weight;
}

TEST(AttributeDistance, FallsAsAnyStatisticDiffersMore) {
    Random random(6);
    for (const StatisticLayout& layout : kStatistics) {
        Signature a = randomAttributed(random);
        a.attributes->earlier = false;
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

TEST(AttributeDistance, ScoreRisesWithTheAgreement) {
    Random random(7);
    for (int round = 0; round < 300; ++round) {
        const AttributedPair pair = randomAttributedPair(random);
        const std::uint8_t qualityA = pair.a.attributes->quality;
        const std::uint8_t qualityB = pair.b.attributes->quality;
        const AttributeDistance distance = attributeDistance(
            statisticsDistance(sumsOf(pair.a, pair.b), qualityA, qualityB), qualityA, qualityB, 0.0);
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

// Statistics of paths of an earlier version mean something else.
TEST(AttributeDistance, PathsOfEarlierVersionsAreLeftOut) {
    Random random(9);
    Signature a = randomAttributed(random);
    Signature b = randomAttributed(random);
    const auto before = termsOf(a, b, 0.5);
    const auto sums = sumsOf(a, b);
    const Grounds now(a.attributes->quality);
    const Grounds earlier(b.attributes->quality, true);
    for (const auto& terms : {scoreTerms(sums, now, earlier, 0.5), scoreTerms(sums, earlier, now, 0.5),
                              scoreTerms(sums, earlier, earlier, 0.5)}) {
        double total = 0.0;
        for (std::size_t kind = 0; kind < kStatisticKinds; ++kind) {
            if (kStatistics[kind].ofPaths) {
                EXPECT_GT(before[kind].weight, 0.0);
                EXPECT_EQ(terms[kind].weight, 0.0);
            }
            total += terms[kind].weight;
        }
        EXPECT_NEAR(total + terms.back().weight, 1.0, 1e-12);
    }
    // Whatever they say, the score is the same.
    b.attributes->earlier = true;
    const double left = score(a, b, {});
    for (const StatisticLayout& layout : kStatistics) {
        if (!layout.ofPaths) continue;
        for (std::size_t i = layout.offset; i < layout.offset + layout.count; ++i) {
            b.attributes->statistics[i] = static_cast<std::uint8_t>((b.attributes->statistics[i] + 5) % 16);
        }
    }
    EXPECT_EQ(score(a, b, {}), left);
    EXPECT_EQ(score(b, a, {}), left);
}

// What depends on the interior weighs less, the less reliable it is, than what the surface shows.
TEST(AttributeDistance, InteriorTermsWeighMoreTheBetterTheInterior) {
    Random random(8);
    const auto weights = [](const Signature& a, const Signature& b) {
        double interior = 0.0;
        double surface = 0.0;
        const auto terms = termsOf(a, b, 0.5);
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
        EXPECT_GT(now, 0.0) << "never zero";
        EXPECT_GE(now, before);
        EXPECT_EQ(now, weights(b, a));
        b.attributes->quality = static_cast<std::uint8_t>(quality);
        EXPECT_EQ(now, weights(a, b)) << "the worse decides";
        before = now;
    }
    a.attributes->quality = 20;
    b.attributes->quality = 20;
    EXPECT_LT(weights(a, b), before - 0.1);
}

// One side of a surface has the same outline as both, so the outline gains what the rest loses.
TEST(AttributeDistance, OutlineDecidesWhereTheInteriorIsUnreliable) {
    Random random(81);
    Signature a = randomAttributed(random);
    Signature b = randomAttributed(random);
    b.attributes->quality = 255;
    const auto weights = [&](int quality) {
        a.attributes->quality = static_cast<std::uint8_t>(quality);
        std::array<double, 3> sums{};
        const auto terms = termsOf(a, b, 0.5);
        for (std::size_t kind = 0; kind < kStatisticKinds; ++kind) {
            sums[static_cast<std::size_t>(kStatistics[kind].evidence)] += terms[kind].weight;
        }
        return sums;
    };
    const auto reliable = weights(255);
    const auto unreliable = weights(0);
    EXPECT_EQ(reliable, weights(128)) << "half quality is fully trusted";
    EXPECT_GT(unreliable[2], 4.0 * reliable[2]);
    EXPECT_LT(unreliable[0], 0.02);
    // Surface against outline: 1 to a half when reliable, a half to 1 when not; three kinds to two.
    EXPECT_NEAR(reliable[1] / reliable[2], 3.0, 1e-9);
    EXPECT_NEAR(unreliable[1] / unreliable[2], 0.75, 1e-9);
    // Partial: the contained parts count less, too.
    a.attributes->quality = 255;
    EXPECT_DOUBLE_EQ(containedWeightOf(a, b), 0.5);
    a.attributes->quality = 0;
    EXPECT_DOUBLE_EQ(containedWeightOf(a, b), 0.25);
}

TEST(AttributeDistance, ReversingTheOutlineDoesNotChangeTheScore) {
    Random random(82);
    for (int round = 0; round < 100; ++round) {
        const AttributedPair pair = randomAttributedPair(random);
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
            expectSoundScore(pair.b, turned, options);
        }
        const auto terms = termsOf(pair.b, turned, 1.0);
        for (std::size_t kind = 0; kind < kStatisticKinds; ++kind) EXPECT_EQ(terms[kind].distance, 0.0);
        EXPECT_LT(score(pair.b, turned, {}), 1.0) << "not the same bytes";
    }
}

}  // namespace
}  // namespace shapedb
