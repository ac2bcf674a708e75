// SPDX-License-Identifier: Apache-2.0
// Words and numbers from lines of text: fast, and independent of the locale. Private to client/io.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace shapedb::io {

inline bool isBlank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f'; }

/// Removes the next word from the front of `rest`; empty if there is none.
inline std::string_view nextWord(std::string_view& rest) {
    std::size_t begin = 0;
    while (begin < rest.size() && isBlank(rest[begin])) ++begin;
    std::size_t end = begin;
    while (end < rest.size() && !isBlank(rest[end])) ++end;
    const std::string_view word = rest.substr(begin, end - begin);
    rest.remove_prefix(end);
    return word;
}

/// The line up to a '#', but for one within a number: "1.#QNAN" is what Windows writes for NaN.
std::string_view withoutComment(std::string_view line);

inline bool isBlankLine(std::string_view line) {
    while (!line.empty() && isBlank(line.front())) line.remove_prefix(1);
    return line.empty();
}

/// Reads the whole word as a decimal number, "nan" and "inf" included; the exponent may be a Fortran one
/// ("1D0"). Beyond the range of double it becomes infinite or 0. False if it is anything else.
bool parseReal(std::string_view word, double& value);

/// Reads the whole word as an integer with optional sign. False if it is none or does not fit.
bool parseInteger(std::string_view word, std::int64_t& value);
bool parseCount(std::string_view word, std::uint64_t& value);

/// ASCII letters only.
std::string lowerCase(std::string_view word);
std::string upperCase(std::string_view word);
/// Equal except for ASCII case; `lower` must be lower case.
bool equalsIgnoringCase(std::string_view word, std::string_view lower);

/// For messages: the word, shortened, without control characters.
std::string printable(std::string_view word);

/// For messages: the word in quotes, shortened, without control characters; "nothing" if empty.
std::string inQuotes(std::string_view word);

/// For messages: inQuotes of what stands where a number should, and advice if it is one with a decimal comma.
std::string inQuotesNotANumber(std::string_view word);

}  // namespace shapedb::io
