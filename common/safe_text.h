// SPDX-License-Identifier: Apache-2.0
// Untrusted text, made safe for terminals, logs and keys.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace shapedb {

/// Valid UTF-8 without overlong forms, which would give one text several spellings.
[[nodiscard]] bool isUtf8(std::string_view text) noexcept;

/// The byte at which the first character begins that changes how a terminal or a log shows the text, or that
/// hides in it: control characters (C0, DEL, C1), line and paragraph separators, characters of format such as
/// marks that change the direction of writing, those that are shown as nothing (zero width space, joiners,
/// variation selectors, fillers, tags, byte order mark), and bytes that are no UTF-8. npos: there is none.
[[nodiscard]] std::size_t findUnsafe(std::string_view text) noexcept;

/// Each of these characters as \uXXXX, or two of these, as JSON spells them, and each invalid byte as \ufffd.
/// `newlines`: keep line feeds.
[[nodiscard]] std::string escapeUnsafe(std::string_view text, bool newlines = false);

/// At most `limit` bytes of `text`, never half a UTF-8 character.
[[nodiscard]] std::string cutText(const std::string& text, std::size_t limit);

}  // namespace shapedb
