// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/cli/text.h"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

#include "core/base/number_text.h"

namespace shapedb::cli {
namespace {

TEST(Text, NumbersHaveFourSignificantDigits) {
    EXPECT_EQ(formatNumber(0.0), "0");
    EXPECT_EQ(formatNumber(-0.0), "0");
    EXPECT_EQ(formatNumber(12.5), "12.5");
    EXPECT_EQ(formatNumber(0.48913), "0.4891");
    EXPECT_EQ(formatNumber(1234567.0), "1.235e+06");
    EXPECT_EQ(formatNumber(-2e-9), "-2e-09");
    EXPECT_EQ(formatFixed(0.4889, 3), "0.489");
    EXPECT_EQ(formatFixed(std::numeric_limits<double>::max(), 0).size(), 309u);
}

TEST(Text, ExactNumbersAreShortAndReadBack) {
    EXPECT_EQ(exactNumber(0.1), "0.1");
    EXPECT_EQ(exactNumber(-0.0), "0");
    EXPECT_EQ(exactNumber(1.0), "1");
    for (const double value : {1.0 / 3.0, -4'512'345.123456789, 1e-300, 1.7976931348623157e308}) {
        EXPECT_EQ(std::stod(exactNumber(value)), value);
    }
}

TEST(Text, RatesAreOfASecondOrAMinute) {
    EXPECT_EQ(formatRate(12'345.6), "12,346 a second");
    EXPECT_EQ(formatRate(34.56), "34.6 a second");
    EXPECT_EQ(formatRate(1.0), "1 a second");
    EXPECT_EQ(formatRate(0.05), "3 a minute");
}

TEST(Text, CountsAreGroupedByThousands) {
    EXPECT_EQ(formatCount(0), "0");
    EXPECT_EQ(formatCount(999), "999");
    EXPECT_EQ(formatCount(1000), "1,000");
    EXPECT_EQ(formatCount(362272), "362,272");
    EXPECT_EQ(formatCount(std::numeric_limits<std::uint64_t>::max()), "18,446,744,073,709,551,615");
    EXPECT_EQ(formatCount(1, "shape", "shapes"), "1 shape");
    EXPECT_EQ(formatCount(0, "shape", "shapes"), "0 shapes");
}

TEST(Text, BytesChangeUnitWithoutPrinting1024) {
    EXPECT_EQ(formatBytes(0), "0 B");
    EXPECT_EQ(formatBytes(1023), "1023 B");
    EXPECT_EQ(formatBytes(1024), "1.0 KiB");
    EXPECT_EQ(formatBytes((1u << 20) - 1), "1.0 MiB");
    EXPECT_EQ(formatBytes(std::uint64_t{3} << 29), "1.5 GiB");
}

TEST(Text, SecondsFromMillisecondsToDays) {
    EXPECT_EQ(formatSeconds(-1.0), "0 s");
    EXPECT_EQ(formatSeconds(std::nan("")), "0 s");
    EXPECT_EQ(formatSeconds(0.035), "35 ms");
    EXPECT_EQ(formatSeconds(0.9999), "1 s");
    EXPECT_EQ(formatSeconds(4.21), "4.21 s");
    EXPECT_EQ(formatSeconds(59.96), "1 min");
    EXPECT_EQ(formatSeconds(200.0), "3 min 20 s");
    EXPECT_EQ(formatSeconds(7500.0), "2 h 5 min");
    EXPECT_EQ(formatSeconds(3.0 * 86400 + 4 * 3600), "3 d 4 h");
}

TEST(Text, ANameStaysInItsLine) {
    EXPECT_EQ(inLine("mug 1.ply"), "mug 1.ply");
    EXPECT_EQ(inLine("a\nb\xff"), "a\\u000ab\\ufffd");
}

TEST(Text, NumbersAreAsSomebodyTypesThem) {
    EXPECT_EQ(numberText(2.0), "2");
    EXPECT_EQ(numberText(0.1), "0.1");
    EXPECT_EQ(numberText(-0.0), "0");
    EXPECT_EQ(numberText(-2.5e-7), "-2.5e-07");
}

TEST(Text, PercentOfSmallAndLargeShares) {
    EXPECT_EQ(formatPercent(0.0), "0 %");
    EXPECT_EQ(formatPercent(0.42), "42 %");
    EXPECT_EQ(formatPercent(0.9999), "100 %");
    EXPECT_EQ(formatPercent(0.003), "0.3 %");
    EXPECT_EQ(formatPercent(0.0996), "10 %");
}

TEST(Text, BarFillsInEighthsAndKeepsItsWidth) {
    EXPECT_EQ(bar(0.0, 4), "    ");
    EXPECT_EQ(bar(1.0, 4), "████");
    EXPECT_EQ(bar(0.5, 4), "██  ");
    EXPECT_EQ(bar(1.0 / 32.0, 4), "▏   ");
    EXPECT_EQ(bar(7.0, 2), "██");
    EXPECT_EQ(bar(std::nan(""), 2), "  ");
    for (int i = 0; i <= 100; ++i) EXPECT_EQ(displayWidth(bar(i / 100.0, 7)), 7u) << i;
}

TEST(Text, TableAlignsAndLeavesNoTrailingBlanks) {
    Table table({{"n", Table::Align::kRight}, {"name"}, {"x"}});
    table.add({"1", "größer", "a"});
    table.add({"10", "b"});
    EXPECT_EQ(table.render(),
              " n  name    x\n"
              " 1  größer  a\n"
              "10  b\n");
    EXPECT_FALSE(table.empty());
}

TEST(Text, TableWithoutTitlesHasNoTitleLine) {
    Table table({{""}, {""}});
    EXPECT_TRUE(table.empty());
    table.add({"key", "value"});
    EXPECT_EQ(table.render(), "key  value\n");
}

}  // namespace
}  // namespace shapedb::cli
