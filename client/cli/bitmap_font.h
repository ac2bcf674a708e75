// A 5x7 pixel font for the few words in a picture; ASCII only.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

namespace shapedb::cli {

inline constexpr std::size_t kGlyphColumns = 5;
inline constexpr std::size_t kGlyphRows = 8;     ///< seven above the base line, one for descenders
inline constexpr std::size_t kGlyphAdvance = 6;  ///< pixels from one character to the next

/// The columns of a character from left to right; bit r is set where row r (from the top) is ink.
/// A character outside printable ASCII shows as `?`. Valid for ever; any thread.
[[nodiscard]] const std::array<std::uint8_t, kGlyphColumns>& glyphOf(char c) noexcept;

}  // namespace shapedb::cli
