// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/signature/histogram.h"

#include <limits>

#include <gtest/gtest.h>

#include "core/base/random.h"
#include "tests/core/signature/cube_views.h"

namespace shapedb {
namespace {

using testing_support::levelsOf;
using testing_support::triangle;

TEST(SoftBin, SharesAValueBetweenTheTwoNearestBins) {
    Random random(1);
    for (int round = 0; round < 20000; ++round) {
        const double low = random.uniform(-3, 3);
        const double high = low + random.uniform(0.1, 5);
        const std::size_t n = 2 + random.below(30);
        const double value = random.uniform(low - 2, high + 2);
        const SoftBin bin = softBin(value, low, high, n);
        ASSERT_LE(bin.bin + 1, n - 1);
        ASSERT_GE(bin.share, 0.0);
        ASSERT_LE(bin.share, 1.0);
        for (std::size_t i = 0; i < n; ++i) {
            const double got = i == bin.bin ? 1.0 - bin.share : i == bin.bin + 1 ? bin.share : 0.0;
            ASSERT_NEAR(got, triangle(value, low, high, n, i), 1e-9)
                << value << " in " << low << ".." << high;
        }
    }
}

TEST(SoftBin, EndsBelongToTheEndBins) {
    const double infinity = std::numeric_limits<double>::infinity();
    const double nan = std::numeric_limits<double>::quiet_NaN();
    for (const double value : {-infinity, -1e300, -0.1, 0.0, 0.05, nan}) {
        EXPECT_EQ(softBin(value, 0.0, 1.0, 10).bin, 0U) << value;
        EXPECT_EQ(softBin(value, 0.0, 1.0, 10).share, 0.0) << value;
    }
    for (const double value : {0.95, 1.0, 1.1, 1e300, infinity}) {
        const SoftBin bin = softBin(value, 0.0, 1.0, 10);
        EXPECT_NEAR(static_cast<double>(bin.bin) + bin.share, 9.0, 1e-12) << value;
    }
}

TEST(Histogram, IsZeroWhenEmpty) {
    const Histogram none(3, 4);
    std::uint8_t bytes[12];
    for (std::uint8_t& b : bytes) b = 99;
    none.writeLevels(bytes);
    for (const std::uint8_t b : bytes) EXPECT_EQ(b, 0);
    Histogram weightless(1, 4);
    weightless.add(softBin(0.3, 0.0, 1.0, 4), 0.0);
    weightless.writeLevels(bytes);
    for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(bytes[i], 0);
}

TEST(Histogram, WritesLevelsOfShares) {
    Random random(2);
    constexpr std::size_t kRows = 3;
    constexpr std::size_t kColumns = 5;
    Histogram histogram(kRows, kColumns);
    std::vector<double> sums(kRows * kColumns, 0.0);
    for (int n = 0; n < 100; ++n) {
        const double row = random.uniform(-0.2, 1.2);
        const double column = random.uniform(1.5, 4.5);
        const double weight = random.uniform();
        histogram.add(softBin(row, 0.0, 1.0, kRows), softBin(column, 2.0, 4.0, kColumns), weight);
        for (std::size_t r = 0; r < kRows; ++r) {
            for (std::size_t c = 0; c < kColumns; ++c) {
                sums[r * kColumns + c] +=
                    weight * triangle(row, 0.0, 1.0, kRows, r) * triangle(column, 2.0, 4.0, kColumns, c);
            }
        }
    }
    std::vector<std::uint8_t> bytes(kRows * kColumns);
    histogram.writeLevels(bytes.data());
    EXPECT_EQ(bytes, levelsOf(sums));
}

TEST(Levels, StandForShares) {
    EXPECT_EQ(levelOf(-1.0), 0);
    EXPECT_EQ(levelOf(0.0), 0);
    EXPECT_EQ(levelOf(0.25), 11);  // 10.6
    EXPECT_EQ(levelOf(0.5), 15);
    EXPECT_EQ(levelOf(1.0), 15);
    EXPECT_EQ(levelOf(7.0), 15);
    EXPECT_EQ(shareOfLevel(0), 0.0);
    EXPECT_NEAR(shareOfLevel(15), 0.5, 1e-12);
    for (std::uint8_t level = 0; level <= kTopLevel; ++level) EXPECT_EQ(levelOf(shareOfLevel(level)), level);
    for (int root = 0; root < 256; ++root) {
        EXPECT_EQ(levelOfRootByte(static_cast<std::uint8_t>(root)), levelOf(root / 255.0 * (root / 255.0)));
    }
}

}  // namespace
}  // namespace shapedb
