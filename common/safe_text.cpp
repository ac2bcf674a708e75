// SPDX-License-Identifier: Apache-2.0
#include "common/safe_text.h"

#include <array>
#include <cstdint>
#include <cstdio>

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

bool isUnsafe(std::uint32_t code) noexcept {
    const auto within = [&](std::uint32_t first, std::uint32_t last) {
        return code >= first && code <= last;
    };
    return code < 0x20 || within(0x7f, 0x9f) ||  // C0, DEL, C1
           code == 0xad || code == 0x61c ||
           code == 0x180e ||  // soft hyphen, Arabic letter mark, Mongolian separator
           code == 0x200b || within(0x200e, 0x200f) ||  // zero width space, left-to-right and right-to-left
           within(0x2028, 0x202e) ||                    // separators, embeddings
           within(0x2060, 0x206f) ||                    // word joiner, isolates
           code == 0xfeff || within(0xfff9, 0xfffb);    // byte order mark, annotations
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
            std::array<char, 8> escaped{};
            std::snprintf(escaped.data(), escaped.size(), "\\u%04x", static_cast<unsigned>(character.code));
            safe += escaped.data();
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
