// SPDX-License-Identifier: GPL-3.0-or-later
#include "core/base/double2.h"

#include <cmath>
#include <limits>
#include <vector>

#include <gtest/gtest.h>

namespace shapedb {
namespace {

// Every operation is tried on every pair of these, in both halves.
const std::vector<double> kNumbers = {0.0,   1.0,     -1.0,   0.1,   -3.7,
                                      1e300, -1e-300, 5e-324, 1e308, std::numeric_limits<double>::infinity()};

void expectSame(double found, double expected, const char* what, double a, double b) {
    if (std::isnan(expected)) {
        EXPECT_TRUE(std::isnan(found)) << a << what << b;
    } else {
        EXPECT_EQ(found, expected) << a << what << b;
        EXPECT_EQ(std::signbit(found), std::signbit(expected)) << a << what << b;
    }
}

template <typename OfPair, typename OfOne>
void compare(const char* what, OfPair ofPair, OfOne ofOne) {
    for (const double a : kNumbers) {
        for (const double b : kNumbers) {
            const Double2 found = ofPair(Double2(a, b), Double2(b, 3.0));
            expectSame(found.low(), ofOne(a, b), what, a, b);
            expectSame(found.high(), ofOne(b, 3.0), what, b, 3.0);
        }
    }
}

TEST(Double2, EachHalfHasTheBitsOfAPlainDouble) {
    compare(
        "+", [](Double2 a, Double2 b) { return a + b; }, [](double a, double b) { return a + b; });
    compare(
        "-", [](Double2 a, Double2 b) { return a - b; }, [](double a, double b) { return a - b; });
    compare(
        "*", [](Double2 a, Double2 b) { return a * b; }, [](double a, double b) { return a * b; });
    compare(
        "/", [](Double2 a, Double2 b) { return a / b; }, [](double a, double b) { return a / b; });
    compare(
        "lesser", [](Double2 a, Double2 b) { return lesser(a, b); },
        [](double a, double b) { return a < b ? a : b; });
    compare(
        "greater", [](Double2 a, Double2 b) { return greater(a, b); },
        [](double a, double b) { return a > b ? a : b; });
    compare(
        "sqrt", [](Double2 a, Double2) { return sqrt(a); }, [](double a, double) { return std::sqrt(a); });
    compare(
        "abs", [](Double2 a, Double2) { return abs(a); }, [](double a, double) { return std::abs(a); });
}

TEST(Double2, LessReportsOneBitPerHalf) {
    const double nan = std::numeric_limits<double>::quiet_NaN();
    EXPECT_EQ(less(Double2(1.0, 2.0), Double2(2.0, 1.0)), 1U);
    EXPECT_EQ(less(Double2(2.0, 1.0), Double2(1.0, 2.0)), 2U);
    EXPECT_EQ(less(Double2(1.0, 1.0), Double2(1.0, 2.0)), 2U);
    EXPECT_EQ(less(Double2(1.0), Double2(2.0)), 3U);
    EXPECT_EQ(less(Double2(nan, 1.0), Double2(2.0, nan)), 0U);
}

}  // namespace
}  // namespace shapedb
