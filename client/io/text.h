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

inline std::string_view withoutComment(std::string_view line, char sign = '#') {
    return line.substr(0, line.find(sign));
}

/// Reads the whole word as a decimal number, "nan" and "inf" included. Beyond the range of double it becomes
/// infinite or 0. False if it is anything else.
bool parseReal(std::string_view word, double& value);

/// Reads the whole word as an integer with optional sign. False if it is none or does not fit.
bool parseInteger(std::string_view word, std::int64_t& value);
bool parseCount(std::string_view word, std::uint64_t& value);

/// ASCII lower case.
std::string lowerCase(std::string_view word);
/// Equal except for ASCII case; `lower` must be lower case.
bool equalsIgnoringCase(std::string_view word, std::string_view lower);

/// For messages: the word in quotes, shortened, without control characters; "nothing" if empty.
std::string inQuotes(std::string_view word);

}  // namespace shapedb::io
