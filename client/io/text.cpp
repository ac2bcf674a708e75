// SPDX-License-Identifier: Apache-2.0
#include "client/io/text.h"

#include <algorithm>
#include <charconv>
#include <limits>
#include <system_error>

namespace shapedb::io {

namespace {

char lowered(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

std::string_view withoutPlus(std::string_view word) {
    // from_chars takes no plus sign. "+-1" must stay wrong.
    if (word.size() > 1 && word[0] == '+' && word[1] != '-') word.remove_prefix(1);
    return word;
}

// Whether a number outside the range of double is too small rather than too large.
bool isTiny(std::string_view word) {
    const std::size_t exponentAt = std::min(word.find_first_of("eE"), word.size());
    std::int64_t exponent = 0;
    if (exponentAt < word.size()) {
        const std::string_view digits = withoutPlus(word.substr(exponentAt + 1));
        const auto parsed = std::from_chars(digits.data(), digits.data() + digits.size(), exponent);
        if (parsed.ec == std::errc::result_out_of_range) return digits[0] == '-';
    }
    const std::string_view mantissa = word.substr(0, exponentAt);
    const std::size_t point = std::min(mantissa.find('.'), mantissa.size());
    const std::size_t first = mantissa.find_first_of("123456789");
    if (first == std::string_view::npos) return true;
    const auto magnitude = static_cast<std::int64_t>(point) - static_cast<std::int64_t>(first);
    return exponent < -magnitude;
}

template <typename Integer>
bool parseWhole(std::string_view word, Integer& value) {
    word = withoutPlus(word);
    const auto parsed = std::from_chars(word.data(), word.data() + word.size(), value);
    return parsed.ec == std::errc() && parsed.ptr == word.data() + word.size();
}

// A number that from_chars reads up to `end` only.
bool parseUnusualReal(std::string_view word, std::size_t end, double& value) {
    if (word[end] == 'd' || word[end] == 'D') {
        std::string exponent(word);
        exponent[end] = 'e';
        // Not if it is no exponent, "1d", nor if another one follows, "1d2d3".
        return word.find_first_of("dD", end + 1) == std::string_view::npos && end + 1 < word.size() &&
               parseReal(exponent, value);
    }
    if (word[end] != '#') return false;
    const std::string kind = lowerCase(word.substr(end));
    const bool infinite = kind.rfind("#inf", 0) == 0;
    if (!infinite && kind.find("nan") == std::string::npos && kind.rfind("#ind", 0) != 0) return false;
    value = infinite ? std::numeric_limits<double>::infinity() : std::numeric_limits<double>::quiet_NaN();
    return true;
}

bool isDigit(char c) { return c >= '0' && c <= '9'; }

}  // namespace

std::string_view withoutComment(std::string_view line) {
    std::size_t sign = line.find('#');
    while (sign != std::string_view::npos && sign > 0 && line[sign - 1] == '.')
        sign = line.find('#', sign + 1);
    return line.substr(0, sign);
}

bool parseReal(std::string_view word, double& value) {
    word = withoutPlus(word);
    const auto parsed = std::from_chars(word.data(), word.data() + word.size(), value);
    if (parsed.ec == std::errc::invalid_argument) return false;
    if (parsed.ptr != word.data() + word.size()) {
        return parseUnusualReal(word, static_cast<std::size_t>(parsed.ptr - word.data()), value);
    }
    if (parsed.ec == std::errc::result_out_of_range) {
        value = isTiny(word) ? 0.0 : std::numeric_limits<double>::infinity();
    }
    return true;
}

bool parseInteger(std::string_view word, std::int64_t& value) { return parseWhole(word, value); }

bool parseCount(std::string_view word, std::uint64_t& value) { return parseWhole(word, value); }

std::string lowerCase(std::string_view word) {
    std::string lower(word);
    std::transform(lower.begin(), lower.end(), lower.begin(), lowered);
    return lower;
}

std::string upperCase(std::string_view word) {
    std::string upper(word);
    std::transform(upper.begin(), upper.end(), upper.begin(),
                   [](char c) { return c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c; });
    return upper;
}

bool equalsIgnoringCase(std::string_view word, std::string_view lower) {
    return word.size() == lower.size() && std::equal(word.begin(), word.end(), lower.begin(),
                                                     [](char a, char b) { return lowered(a) == b; });
}

std::string printable(std::string_view word) {
    constexpr std::size_t kLongest = 40;
    std::string text;
    for (const char c : word.substr(0, kLongest)) text += c >= ' ' && c <= '~' ? c : '?';
    return text + (word.size() > kLongest ? "..." : "");
}

std::string inQuotes(std::string_view word) { return word.empty() ? "nothing" : "'" + printable(word) + "'"; }

std::string inQuotesNotANumber(std::string_view word) {
    const std::size_t comma = word.find(',');
    const bool decimal = comma != std::string_view::npos && comma + 1 < word.size() && comma > 0 &&
                         isDigit(word[comma - 1]) && isDigit(word[comma + 1]);
    return inQuotes(word) + (decimal ? ": decimals are written with a point, not with a comma" : "");
}

}  // namespace shapedb::io
