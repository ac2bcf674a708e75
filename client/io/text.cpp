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

}  // namespace

bool parseReal(std::string_view word, double& value) {
    word = withoutPlus(word);
    const auto parsed = std::from_chars(word.data(), word.data() + word.size(), value);
    if (parsed.ptr != word.data() + word.size() || parsed.ec == std::errc::invalid_argument) return false;
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

bool equalsIgnoringCase(std::string_view word, std::string_view lower) {
    return word.size() == lower.size() && std::equal(word.begin(), word.end(), lower.begin(),
                                                     [](char a, char b) { return lowered(a) == b; });
}

std::string inQuotes(std::string_view word) {
    constexpr std::size_t kLongest = 40;
    if (word.empty()) return "nothing";
    std::string text = "'";
    for (const char c : word.substr(0, kLongest)) text += c >= ' ' && c <= '~' ? c : '?';
    return text + (word.size() > kLongest ? "...'" : "'");
}

}  // namespace shapedb::io
