// Words and numbers out of lines of text: fast, and the same in every locale.
// Private to client/io.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace shapedb::io {

inline bool isBlank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f'; }

/// Takes the next word off the front of `rest`; empty when there is none.
inline std::string_view nextWord(std::string_view& rest) {
    std::size_t begin = 0;
    while (begin < rest.size() && isBlank(rest[begin])) ++begin;
    std::size_t end = begin;
    while (end < rest.size() && !isBlank(rest[end])) ++end;
    const std::string_view word = rest.substr(begin, end - begin);
    rest.remove_prefix(end);
    return word;
}

/// The line up to a comment sign.
inline std::string_view withoutComment(std::string_view line, char sign = '#') {
    return line.substr(0, line.find(sign));
}

/// The whole word as a decimal number. "nan" and "inf" are numbers here; a magnitude above the
/// range of double becomes infinite and one below it 0. False if the word is anything else.
bool parseReal(std::string_view word, double& value);

/// The whole word as an integer (optional sign) that fits. False otherwise.
bool parseInteger(std::string_view word, std::int64_t& value);
bool parseCount(std::string_view word, std::uint64_t& value);

/// ASCII lower case.
std::string lowerCase(std::string_view word);
/// Equal but for ASCII case; `lower` is lower case already.
bool equalsIgnoringCase(std::string_view word, std::string_view lower);

/// For messages: the word in quotes, shortened, without control characters; "nothing" if empty.
std::string inQuotes(std::string_view word);

}  // namespace shapedb::io
