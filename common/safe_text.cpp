// SPDX-License-Identifier: Apache-2.0
#include "common/safe_text.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <iterator>

namespace shapedb {

namespace {

struct Character {
    std::uint32_t code = 0;
    std::size_t length = 0;  ///< bytes; 0: not valid
};

Character characterAt(std::string_view text, std::size_t at) noexcept {
    const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(text[i]); };
    const unsigned char first = byte(at);
    if (first < 0x80) return {first, 1};
    std::size_t length = 0;
    std::uint32_t code = 0;
    std::uint32_t smallest = 0;
    if ((first & 0xe0) == 0xc0) {
        length = 2, code = first & 0x1fu, smallest = 0x80;
    } else if ((first & 0xf0) == 0xe0) {
        length = 3, code = first & 0x0fu, smallest = 0x800;
    } else if ((first & 0xf8) == 0xf0) {
        length = 4, code = first & 0x07u, smallest = 0x10000;
    }
    if (length == 0 || at + length > text.size()) return {};
    for (std::size_t i = 1; i < length; ++i) {
        if ((byte(at + i) & 0xc0) != 0x80) return {};
        code = (code << 6) | (byte(at + i) & 0x3fu);
    }
    const bool surrogate = code >= 0xd800 && code <= 0xdfff;
    if (code < smallest || surrogate || code > 0x10ffff) return {};
    return {code, length};
}

struct CodeRange {
    std::uint32_t first;
    std::uint32_t last;
};

/// Unicode 15: general categories Cc (control), Cf (format), Zl and Zp (separators of lines and paragraphs),
/// and the property Default_Ignorable_Code_Point (shown as nothing).
constexpr CodeRange kUnsafe[] = {
    {0x0, 0x1f},        {0x7f, 0x9f},       {0xad, 0xad},       {0x34f, 0x34f},     {0x600, 0x605},
    {0x61c, 0x61c},     {0x6dd, 0x6dd},     {0x70f, 0x70f},     {0x890, 0x891},     {0x8e2, 0x8e2},
    {0x115f, 0x1160},   {0x17b4, 0x17b5},   {0x180b, 0x180f},   {0x200b, 0x200f},   {0x2028, 0x202e},
    {0x2060, 0x206f},   {0x3164, 0x3164},   {0xfe00, 0xfe0f},   {0xfeff, 0xfeff},   {0xffa0, 0xffa0},
    {0xfff0, 0xfffb},   {0x110bd, 0x110bd}, {0x110cd, 0x110cd}, {0x13430, 0x1343f}, {0x1bca0, 0x1bca3},
    {0x1d173, 0x1d17a}, {0xe0000, 0xe0fff}};

bool isUnsafe(std::uint32_t code) noexcept {
    // The last one that does not begin behind it.
    const CodeRange* const next =
        std::upper_bound(std::begin(kUnsafe), std::end(kUnsafe), code,
                         [](std::uint32_t c, const CodeRange& range) { return c < range.first; });
    return next != std::begin(kUnsafe) && code <= std::prev(next)->last;
}

/// "\u200b", and of what has more than 16 bits both halves, as JSON spells it.
std::string escapeOf(std::uint32_t code) {
    std::array<char, 32> text{};
    if (code <= 0xffff) {
        std::snprintf(text.data(), text.size(), "\\u%04x", code);
    } else {
        const std::uint32_t rest = code - 0x10000;
        std::snprintf(text.data(), text.size(), "\\u%04x\\u%04x", 0xd800 + (rest >> 10),
                      0xdc00 + (rest & 0x3ff));
    }
    return text.data();
}

}  // namespace

bool isUtf8(std::string_view text) noexcept {
    for (std::size_t i = 0; i < text.size();) {
        const std::size_t length = characterAt(text, i).length;
        if (length == 0) return false;
        i += length;
    }
    return true;
}

std::size_t findUnsafe(std::string_view text) noexcept {
    for (std::size_t i = 0; i < text.size();) {
        const Character character = characterAt(text, i);
        if (character.length == 0 || isUnsafe(character.code)) return i;
        i += character.length;
    }
    return std::string_view::npos;
}

std::string escapeUnsafe(std::string_view text, bool newlines) {
    std::string safe;
    safe.reserve(text.size());
    for (std::size_t i = 0; i < text.size();) {
        const Character character = characterAt(text, i);
        const bool kept = newlines && character.code == '\n' && character.length == 1;
        if (character.length == 0) {
            safe += "\\ufffd";
        } else if (isUnsafe(character.code) && !kept) {
            safe += escapeOf(character.code);
        } else {
            safe.append(text, i, character.length);
        }
        i += character.length == 0 ? 1 : character.length;
    }
    return safe;
}

std::string cutText(const std::string& text, std::size_t limit) {
    if (text.size() <= limit) return text;
    std::size_t end = limit;
    // Back over continuation bytes (10xxxxxx), so that no character is cut in two.
    while (end > 0 && (static_cast<unsigned char>(text[end]) & 0xc0) == 0x80) --end;
    return text.substr(0, end);
}

}  // namespace shapedb
