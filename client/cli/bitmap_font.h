// SPDX-License-Identifier: GPL-3.0-or-later
// A 5x7 pixel font for the labels of a picture; ASCII only.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace shapedb::cli {

inline constexpr std::size_t kGlyphColumns = 5;
inline constexpr std::size_t kGlyphRows = 8;     ///< seven above the base line, one for descenders
inline constexpr std::size_t kGlyphAdvance = 6;  ///< pixels from one character to the next

/// The columns of a character from left to right; bit r of a column is row r from the top. Characters outside
/// printable ASCII are drawn as `?`. The reference is always valid; any thread.
[[nodiscard]] const std::array<std::uint8_t, kGlyphColumns>& glyphOf(char c) noexcept;

}  // namespace shapedb::cli
