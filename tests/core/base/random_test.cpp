// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/base/random.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include <gtest/gtest.h>

namespace shapedb {
namespace {

// The reference stream of SplitMix64 for these seeds, as published with the generator.
TEST(Random, MatchesThePublishedSplitMix64Stream) {
    Random random(1234567);
    const std::array<std::uint64_t, 5> expected = {6457827717110365317ULL, 3203168211198807973ULL,
                                                   9817491932198370423ULL, 4593380528125082431ULL,
                                                   16408922859458223821ULL};
    for (const std::uint64_t value : expected) EXPECT_EQ(random.next(), value);
    EXPECT_EQ(Random(0).next(), 0xe220a8397b1dcdafULL);
}

// A seed written in a document must mean the same numbers in every later version.
TEST(Random, DerivedValuesAreFrozen) {
    Random uniform(42);
    EXPECT_DOUBLE_EQ(uniform.uniform(), 0.7415648787718233);
    EXPECT_DOUBLE_EQ(uniform.uniform(), 0.1599103928769201);
    EXPECT_DOUBLE_EQ(uniform.uniform(), 0.27860113025513866);

    Random normal(42);
    EXPECT_NEAR(normal.normal(), 0.8822489062222688, 1e-14);
    EXPECT_NEAR(normal.normal(), 1.388473285287707, 1e-14);

    Random below(42);
    for (const std::uint64_t value : {7U, 1U, 2U, 3U, 0U, 8U, 2U, 8U}) EXPECT_EQ(below.below(10), value);
}

TEST(Random, StreamDependsOnTheSeedAlone) {
    Random a(9);
    Random b(9);
    Random c(10);
    int equal = 0;
    for (int i = 0; i < 1000; ++i) {
        const std::uint64_t value = a.next();
        EXPECT_EQ(value, b.next());
        equal += value == c.next() ? 1 : 0;
    }
    EXPECT_EQ(equal, 0);
}

// Chi-square with 19 degrees of freedom: 43.8 is exceeded once in a thousand seeds.
TEST(Random, UniformFillsItsCellsEvenly) {
    constexpr int kCells = 20;
    constexpr int kDraws = 200000;
    for (const std::uint64_t seed : {1ULL, 2ULL, 3ULL}) {
        std::array<int, kCells> fromUniform{};
        std::array<int, kCells> fromBelow{};
        Random random(seed);
        for (int i = 0; i < kDraws; ++i) {
            const double u = random.uniform();
            ASSERT_GE(u, 0.0);
            ASSERT_LT(u, 1.0);
            ++fromUniform[static_cast<std::size_t>(u * kCells)];
            const std::uint64_t b = random.below(kCells);
            ASSERT_LT(b, static_cast<std::uint64_t>(kCells));
            ++fromBelow[b];
        }
        const double expected = static_cast<double>(kDraws) / kCells;
        double chiUniform = 0.0;
        double chiBelow = 0.0;
        for (std::size_t i = 0; i < kCells; ++i) {
            chiUniform += std::pow(fromUniform[i] - expected, 2) / expected;
            chiBelow += std::pow(fromBelow[i] - expected, 2) / expected;
        }
        EXPECT_LT(chiUniform, 43.8) << "seed " << seed;
        EXPECT_LT(chiBelow, 43.8) << "seed " << seed;
    }
}

TEST(Random, UniformStaysInsideItsRange) {
    Random random(5);
    double low = 1e9;
    double high = -1e9;
    for (int i = 0; i < 100000; ++i) {
        const double u = random.uniform(-3.0, 5.0);
        low = std::min(low, u);
        high = std::max(high, u);
    }
    EXPECT_GE(low, -3.0);
    EXPECT_LT(high, 5.0);
    EXPECT_NEAR(low, -3.0, 0.01);
    EXPECT_NEAR(high, 5.0, 0.01);
}

TEST(Random, BelowOneIsAlwaysZero) {
    Random random(3);
    for (int i = 0; i < 100; ++i) EXPECT_EQ(random.below(1), 0U);
}

// Moments of the standard normal; the bounds are five standard errors wide.
TEST(Random, NormalHasTheMomentsOfTheStandardNormal) {
    constexpr int kDraws = 400000;
    Random random(11);
    double sum = 0.0;
    double squares = 0.0;
    double cubes = 0.0;
    double fourths = 0.0;
    double products = 0.0;  // of neighbours: the two values of one Box-Muller pair must not correlate
    double previous = 0.0;
    for (int i = 0; i < kDraws; ++i) {
        const double x = random.normal();
        sum += x;
        squares += x * x;
        cubes += x * x * x;
        fourths += x * x * x * x;
        products += x * previous;
        previous = x;
    }
    const double unit = 5.0 / std::sqrt(static_cast<double>(kDraws));
    EXPECT_NEAR(sum / kDraws, 0.0, unit);
    EXPECT_NEAR(squares / kDraws, 1.0, unit * std::sqrt(2.0));
    EXPECT_NEAR(cubes / kDraws, 0.0, unit * std::sqrt(15.0));
    EXPECT_NEAR(fourths / kDraws, 3.0, unit * std::sqrt(96.0));
    EXPECT_NEAR(products / kDraws, 0.0, unit);
}

}  // namespace
}  // namespace shapedb
