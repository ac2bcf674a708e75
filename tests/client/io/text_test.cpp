// SPDX-License-Identifier: GPL-3.0-or-later
#include "client/io/text.h"

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>

#include <gtest/gtest.h>

#include "core/base/random.h"

namespace shapedb::io {
namespace {

double real(const std::string& word) {
    double value = -12345.0;
    EXPECT_TRUE(parseReal(word, value)) << word;
    return value;
}

TEST(Text, ReadsNumbersInEverySpelling) {
    EXPECT_EQ(real("1"), 1.0);
    EXPECT_EQ(real("+1.5"), 1.5);
    EXPECT_EQ(real("-.25"), -0.25);
    EXPECT_EQ(real("3."), 3.0);
    EXPECT_EQ(real("1e3"), 1000.0);
    EXPECT_EQ(real("1E+3"), 1000.0);
    EXPECT_EQ(real("-2.5e-3"), -0.0025);
    EXPECT_TRUE(std::isnan(real("nan")));
    EXPECT_TRUE(std::isnan(real("-NaN")));
    EXPECT_TRUE(std::isinf(real("inf")));
}

TEST(Text, RefusesWordsThatAreNotNumbers) {
    double value = 0.0;
    for (const char* word : {"", "+", "-", "+-1", "1,5", "1.5x", "abc", "0x10", "1e", "--1", ".", "e5"}) {
        EXPECT_FALSE(parseReal(word, value)) << word;
    }
}

TEST(Text, NumbersBeyondDoubleBecomeInfiniteOrZero) {
    const std::string zeros(400, '0');
    EXPECT_TRUE(std::isinf(real("1e999")));
    EXPECT_TRUE(std::isinf(real("-1e999")));
    EXPECT_TRUE(std::isinf(real("1" + zeros)));
    EXPECT_TRUE(std::isinf(real("1e99999999999999999999")));
    EXPECT_EQ(real("1e-999"), 0.0);
    EXPECT_EQ(real("0." + zeros + "1"), 0.0);
    EXPECT_EQ(real("1e-99999999999999999999"), 0.0);
    EXPECT_EQ(real("0e999"), 0.0);
    EXPECT_EQ(real("1e300"), 1e300);
    EXPECT_EQ(real("1e-300"), 1e-300);
}

TEST(Text, AgreesWithStrtodToTheLastBit) {
    Random random(7);
    for (int i = 0; i < 20000; ++i) {
        char word[64];
        const double value = random.uniform(-1.0, 1.0) * std::pow(10.0, random.uniform(-300.0, 300.0));
        std::snprintf(word, sizeof word, "%.*g", 1 + static_cast<int>(random.below(17)), value);
        EXPECT_EQ(real(word), std::strtod(word, nullptr)) << word;
    }
}

TEST(Text, IntegersMustFit) {
    std::int64_t integer = 0;
    EXPECT_TRUE(parseInteger("-9223372036854775808", integer));
    EXPECT_FALSE(parseInteger("9223372036854775808", integer));
    EXPECT_FALSE(parseInteger("1.0", integer));
    std::uint64_t count = 0;
    EXPECT_TRUE(parseCount("18446744073709551615", count));
    EXPECT_FALSE(parseCount("18446744073709551616", count));
    EXPECT_FALSE(parseCount("-1", count));
}

TEST(Text, QuotesOnlyPrintableAndShortText) {
    EXPECT_EQ(inQuotes(""), "nothing");
    EXPECT_EQ(inQuotes("abc"), "'abc'");
    EXPECT_EQ(inQuotes("a\x1b[2J"), "'a?[2J'");
    EXPECT_EQ(inQuotes(std::string(100, 'a')), "'" + std::string(40, 'a') + "...'");
}

TEST(Text, AnyBlanksSeparateWords) {
    std::string_view rest = " \t a bc\v\fd ";
    EXPECT_EQ(nextWord(rest), "a");
    EXPECT_EQ(nextWord(rest), "bc");
    EXPECT_EQ(nextWord(rest), "d");
    EXPECT_EQ(nextWord(rest), "");
}

}  // namespace
}  // namespace shapedb::io
